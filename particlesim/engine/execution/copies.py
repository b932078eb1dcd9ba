"""Copies and zeros of whole arrays, by launches that can be recorded."""

from __future__ import annotations

import warp as wp

from ...kernels.engine.copy import BLOCK, copy_kernel, zero_kernel
from ..model import Model
from .launch import launch


def copy(model: Model, source: wp.array, target: wp.array) -> None:
    """What is in one array to another of its kind and length."""
    block = BLOCK if model.vectorised else 1
    kernel = copy_kernel(source.dtype, block)
    launch(kernel, len(source), [source, target], model.device, block)


def zero(model: Model, target: wp.array) -> None:
    """Zeros in all rows."""
    block = BLOCK if model.vectorised else 1
    launch(zero_kernel(target.dtype, block), len(target), [target], model.device, block)
