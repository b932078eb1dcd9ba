"""Previews: pictures of simulations and recordings by Warp kernels, without a display."""
