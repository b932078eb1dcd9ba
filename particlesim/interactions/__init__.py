"""Forces: what acts at the start of a substep, one file a kind, with what limits its step."""
