"""The live view: recordings and running scenes in the browser, served on loopback."""
