"""Laws on tuples of particles, one file a kind."""
