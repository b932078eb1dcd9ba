"""The watchdog: finds within a frame what is wrong, says what made it so, and acts."""
