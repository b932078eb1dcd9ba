"""How parts answer to small changes, and the limits that follow for the substep."""
