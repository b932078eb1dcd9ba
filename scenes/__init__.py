"""Ready scenes. Each module defines ``build(**options)``, ``settings``, ``frames`` and, where an
answer is known, ``error(sim)``."""
