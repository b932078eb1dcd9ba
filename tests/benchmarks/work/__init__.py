"""The work that cases and other programs share: scenes, their settings, and what is asked of them."""
