"""The work that cases and other programs share: scenes, settings, and what is asked at the end."""
