"""Sending motions: handles to wait for and cancel, servo streams, stopping and recovery."""
