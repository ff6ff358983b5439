"""Mutation testing of the core: what a wrong character in the sources would do, and which tests notice it.

`python -m tests.mutation` changes one expression at a time in a copy of the sources and runs the fast tests of its
package. `mutants` finds and draws the changes, `run` tries them. The changes come from a seed and the text of each
function, so an edit elsewhere does not draw others.
"""
