"""The ledger: work and impulse of every interaction and constraint."""

from .ledger import Ledger

__all__ = ["Ledger"]
