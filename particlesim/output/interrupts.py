"""Ends asked for from outside, by SIGINT (Ctrl+C) and SIGTERM, at moments that can bear them."""

from __future__ import annotations

import contextlib
import signal
import sys
import threading
from collections.abc import Callable, Iterator
from types import FrameType
from typing import Any, NoReturn, Self

SIGNALS = (signal.SIGINT, signal.SIGTERM)


class Terminated(SystemExit):
    """What SIGTERM raises: nothing stays unfinished, and the process exits with 128 + 15."""

    def __init__(self) -> None:
        super().__init__(128 + signal.SIGTERM)


ENDS = (KeyboardInterrupt, Terminated)


def terminate(number: int = signal.SIGTERM, frame: FrameType | None = None) -> NoReturn:
    """The handler of SIGTERM."""
    raise Terminated


_asked: int | None = None  # the signal that asked for an end, of who may not have heard it


def _ask(number: int, frame: FrameType | None) -> None:
    """The handler of both signals in a program of ours."""
    global _asked
    _asked = number
    handler = terminate if number == signal.SIGTERM else signal.default_int_handler
    handler(number, frame)


def heard() -> None:
    """Who caught what was raised ends as it should."""
    global _asked
    _asked = None


@contextlib.contextmanager
def terminable() -> Iterator[None]:
    """Let SIGTERM raise :class:`Terminated`, unless the program has a handler of its own.

    A library that is being loaded may swallow that, and a KeyboardInterrupt as well, and Python
    does in what it calls on its own, as finalizers. Then it comes once more, at the next
    :meth:`Deferred.check` or at the end.
    """
    hook = sys.unraisablehook
    usual: dict[int, Any] = {
        signal.SIGTERM: signal.SIG_DFL, signal.SIGINT: signal.default_int_handler,
    }  # fmt: skip
    ours = [number for number in SIGNALS if signal.getsignal(number) is usual[number]]
    ours = ours if _in_main_thread() else []
    for number in ours:
        signal.signal(number, _ask)
    sys.unraisablehook = lambda told: None if isinstance(told.exc_value, ENDS) else hook(told)
    try:
        yield
        if _asked is not None:
            _ask(_asked, None)
    finally:
        for number in ours:
            signal.signal(number, usual[number])
        sys.unraisablehook = hook
        heard()


class Deferred:
    """Keeps what asks for an end until :meth:`check`, or the end of the ``with``.

    What comes then is what would have come at once: a KeyboardInterrupt, a :class:`Terminated`, or
    what the program's own handlers do. Whoever asks a second time does not want to wait: that comes
    at once. Outside of the main thread, and for signals that are ignored, it does nothing.
    """

    def __init__(self) -> None:
        self.acted = False  # by check, so that all was in order
        self._before: dict[int, Any] = {}
        self._kept: int | None = None
        self._ending = False

    def check(self) -> None:
        """Let what was kept come, or what was swallowed.

        Raises:
            KeyboardInterrupt, Terminated: An end was asked for.
        """
        if self._kept is None and self._before:
            self._kept = _asked
        if self._kept is not None:
            number, self._kept = self._kept, None
            self._ending = self.acted = True
            self._act(number)
            self._ending = self.acted = False  # a handler that goes on

    def __enter__(self) -> Self:
        if _in_main_thread():
            for number in SIGNALS:
                before = signal.getsignal(number)
                if callable(before) or (number, before) == (signal.SIGTERM, signal.SIG_DFL):
                    self._before[number] = before
                    signal.signal(number, self._keep)
        return self

    def __exit__(self, kind: Any, error: BaseException | None, trace: Any) -> None:
        for number, before in self._before.items():
            signal.signal(number, before)
        if error is None:
            self.check()

    def _keep(self, number: int, frame: FrameType | None) -> None:
        if self._ending:
            return  # it ends already
        if self._kept is None:
            self._kept = number
            return
        self._ending = True
        self._act(number)
        self._ending = False

    def _act(self, number: int) -> None:
        before = self._before[number]
        handler: Callable[..., Any] = before if callable(before) else terminate
        handler(number, None)


def _in_main_thread() -> bool:
    """Where alone handlers can be set."""
    return threading.current_thread() is threading.main_thread()
