"""The command line: the same verbs as in Python.

`main` has the table of commands; each command is declared once, as a function with its options and its help. `options`
has the options common to several commands, `output` what they print and read.
"""
