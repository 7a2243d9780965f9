"""Campaigns: one command over many tests. Which tests, on which processes, and what all of them say together."""
