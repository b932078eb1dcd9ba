"""Kernels that watch a simulation: the watchdog's look, the ledger's sums, residuals."""
