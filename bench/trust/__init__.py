"""Attacks and faults: what an outsider can do to the cabinet, and what it keeps doing meanwhile."""
