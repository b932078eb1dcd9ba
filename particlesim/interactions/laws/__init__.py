"""Laws of forces: what fills their arguments, and whether they are what they should be."""
