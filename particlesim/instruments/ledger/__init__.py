"""The ledger: work and impulse of every interaction and constraint."""
