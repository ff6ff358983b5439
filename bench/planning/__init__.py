"""Searches around bodies: problem sets, how many of them are solved, how fast and how well."""
