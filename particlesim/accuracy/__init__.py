"""Speed against accuracy: sweeps, searches and stress, each measured."""
