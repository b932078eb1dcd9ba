"""The live view: recordings and running scenes in the browser, served on loopback."""

from .server import Server

__all__ = ["Server"]
