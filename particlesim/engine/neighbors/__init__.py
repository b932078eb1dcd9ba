"""Who looks at whom: all pairs, Verlet lists, and lists that several parts share."""
