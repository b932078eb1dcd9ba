"""Newton's gravity: between all pairs, or by a tree."""
