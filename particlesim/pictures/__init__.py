"""Pictures and films of recordings and simulations, and the live view."""
