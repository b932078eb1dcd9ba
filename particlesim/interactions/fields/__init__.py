"""Fields that particles act on, and that act on them."""
