"""Watching Warp: what is asked of it is told to somebody before it is done.

For those who record what Python does, users' Python too. Where it is to be watched
:func:`particlesim.kernels.warp_internals.doors` knows.
"""

from __future__ import annotations

import functools
import inspect
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from typing import Any, Protocol

import warp as wp

from .warp_internals import WORK, doors


class Watcher(Protocol):
    """Who is told, in the place of Warp."""

    def launch(self, arguments: dict[str, Any]) -> None:
        """Of ``wp.launch``."""

    def call(self, run: Callable[[], None]) -> None:
        """A fill or a copy, which ``run`` does."""

    def host(self, what: str) -> None:
        """Something that cannot wait is about to be done, unless this raises."""


_watcher: ContextVar[Watcher | None] = ContextVar("watcher", default=None)
_lock = threading.Lock()
_watched = 0  # by how many contexts
_replaced: list[tuple[Any, str, Any]] = []


@contextmanager
def watched(watcher: Watcher | None) -> Iterator[None]:
    """Tell ``watcher`` what is asked of Warp inside, in this thread; None: nobody."""
    token = _watcher.set(watcher)
    _watch(1)
    try:
        yield
    finally:
        _watch(-1)
        _watcher.reset(token)


def _watch(more: int) -> None:
    """Put the watching functions in the place of Warp's, or those back."""
    global _watched
    with _lock:
        before, _watched = _watched, _watched + more
        if before == 0:
            for owner, name, passes in _doors():
                original = vars(owner)[name]
                _replaced.append((owner, name, original))
                setattr(owner, name, _watching(original, passes))
        elif _watched == 0:
            while _replaced:
                setattr(*_replaced.pop())


@functools.cache
def _doors() -> list[tuple[Any, str, str]]:
    return doors()


@functools.cache
def _watching(original: Any, passes: str) -> Any:
    if passes == "launch":
        return _told(original, _launch)
    if passes == "write":
        return _told(original, _write)
    if passes == "native":
        return _Native(original)
    if isinstance(original, property):
        return property(_asked(original.fget, "array.numpy"))
    return _asked(original, passes)


def _told(original: Callable[..., Any], tell: Callable[..., bool]) -> Callable[..., Any]:
    """``original``, unless a watcher has taken it over."""

    @functools.wraps(original)
    def function(*args: Any, **kwargs: Any) -> Any:
        watcher = _watcher.get()
        if watcher is None or not tell(watcher, original, *args, **kwargs):
            return original(*args, **kwargs)
        return None

    return function


def _asked(original: Callable[..., Any], what: str) -> Callable[..., Any]:
    """``original``, unless a watcher will not have it."""

    @functools.wraps(original)
    def function(*args: Any, **kwargs: Any) -> Any:
        watcher = _watcher.get()
        if watcher is None:
            return original(*args, **kwargs)
        watcher.host(what)
        with watched(None):
            return original(*args, **kwargs)

    return function


def _launch(watcher: Watcher, launch: Callable[..., Any], *args: Any, **kwargs: Any) -> bool:
    given = inspect.signature(launch).bind(*args, **kwargs).arguments
    if given.pop("record_cmd", False):
        return False
    if given.get("stream") is None:
        given["device"] = wp.get_device(given.get("device"))
    watcher.launch(given)
    return True


def _write(watcher: Watcher, write: Callable[..., Any], *args: Any, **kwargs: Any) -> bool:
    arrays = [each for each in [*args, *kwargs.values()] if hasattr(each, "is_contiguous")]
    if not all(each.is_contiguous for each in arrays):
        watcher.host("a copy or a fill of an array with gaps")  # which graphs do not take
    watcher.call(functools.partial(write, *args, **kwargs))
    return True


class _Native:
    """Warp's native functions."""

    def __init__(self, functions: Any):
        self._functions = functions

    def __getattr__(self, name: str) -> Any:
        watcher = _watcher.get()
        if watcher is not None and name.startswith(WORK):
            watcher.host(name)
        return getattr(self._functions, name)
