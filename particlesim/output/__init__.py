"""Output: recordings, checkpoints, histories and surfaces in files."""
