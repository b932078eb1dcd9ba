"""Benchmarks: cases that race simulations against each other and against other programs.

A case is a file with a function ``case`` (:mod:`.case` says what it returns). Those of the project
lie in ``tests/benchmarks`` of a checkout; copy one to add another.
"""
