"""Tools for USD files: what is inside, what is wrong with them, and one file made of many."""

from .check import check
from .fault import Fault
from .info import Info, info
from .pack import pack

__all__ = ["Fault", "Info", "check", "info", "pack"]
