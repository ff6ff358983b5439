"""Recordings, the black box, plots, streams of a motion."""
