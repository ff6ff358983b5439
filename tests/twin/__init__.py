"""Tests of the twin: recordings that the virtual cabinet repeats."""
