"""Previews: pictures of simulations and recordings by Warp kernels, without a display."""

from .camera import Camera
from .image import Image

__all__ = ["Camera", "Image"]
