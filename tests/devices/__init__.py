"""Tests of the input devices."""
