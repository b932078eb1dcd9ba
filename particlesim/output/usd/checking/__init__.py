"""Checks of USD files: what usd-core's validators find, and what they do not look at."""
