"""Tests of exported models: read back by the programs for which they are written."""
