"""Ready potentials between pairs, one file a law."""
