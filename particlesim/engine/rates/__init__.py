"""How fast forces answer: rates, and the largest eigenvalues that they follow from."""
