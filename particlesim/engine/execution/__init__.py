"""How recorded frames run: launches, graphs and threads."""
