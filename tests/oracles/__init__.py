"""Algorithms of the extension written again in Python, to compare both over random input. Nothing else uses them."""
