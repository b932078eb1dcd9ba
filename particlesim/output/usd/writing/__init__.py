"""Writing USD frames: the root layer, and value clips with what changes."""
