"""The virtual cabinet: a simulated robot under the real cabinet application."""
