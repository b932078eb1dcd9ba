"""What parts do, recorded: as launches, or as something to be done anew in every substep.

Parts, integrators and observers of users' own do what they like in Python. What is a launch, a fill
or a copy is recorded. Whoever reads arrays on the host, or is another one after every substep,
would do it once and never again: he is found and, as a whole, called in every substep.
"""

from __future__ import annotations

import functools
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
import warp as wp

from .launch import Host, OnHost, Program, record, recording

PLAIN = (int, float, complex, str, bytes, tuple)  # the same if they are equal


def act(part: Any, function: Callable[..., None], *arguments: Any) -> None:
    """Have ``part`` do what ``function`` does: now, or whenever what is being recorded is run.

    Args:
        part: Whose method it is; ``part.host`` says that it works on the host.
        function: A method that launches.
        arguments: Its own.
    """
    program = recording()
    if program is None:
        function(*arguments)
        return
    own, before = Program(hosts=program.hosts), Attributes(part)
    reason = f"{part.name}.host is set" if part.host else program.hosts.get(id(part), "")
    if not reason:
        try:
            with record(own, strict=True):
                function(*arguments)
        except OnHost as met:
            before.restore()
            reason = f"{function.__name__} uses {met}"
    if reason:
        program.add(Host(functools.partial(act, part, function, *arguments), part.name, reason))
    else:
        program.operations += own.operations
        program.acted |= own.acted  # who was asked to act on the way
    if reason or own.touched:
        program.acted.add(id(part))


def on_host(owner: str, function: Callable[[], None], reason: str) -> None:
    """Call ``function``, which works on the host, now or in its turn in every substep.

    What its part launches besides is recorded, which :func:`act` cannot tell apart.

    Args:
        owner: Name of the part.
        reason: What it does there, for ``explain``.
    """
    program = recording()
    if program is None:
        function()
    else:
        program.add(Host(function, owner, reason))


def record_acts(actors: Sequence[Any], substep: Callable[[], None]) -> Program:
    """The program of a substep, in which ``actors`` act.

    Who changes himself on the way is recorded once more, to see whether he is the same from then
    on: one who counts the sweeps of a substep, say, or keeps what he has made.
    """
    start = [Attributes(each) for each in actors]
    program = _recorded(substep, {})
    if not any(each.change() for each in start):
        return program
    # What was filled in the first recording has not been: the second one makes it no more.
    hosts = {id(each.part): each.change() for each in start if each.change(kind=wp.array)}
    then = [Attributes(each) for each in actors]
    program = _recorded(substep, {})
    hosts |= {id(each.part): change for each in then if (change := each.change())}
    if not hosts:
        return program
    for each in start:
        each.restore()
    return _recorded(substep, hosts)


def _recorded(substep: Callable[[], None], hosts: dict[int, str]) -> Program:
    with record(Program(hosts=hosts)) as program:
        substep()
    return program


class Attributes:
    """What a part keeps in Python: its attributes as they are, and where its generators are."""

    def __init__(self, part: Any):
        self.part, self.before = part, dict(vars(part))
        self.random = {
            name: (value.bit_generator, value.bit_generator.state)
            for name, value in self.before.items()
            if isinstance(value, np.random.Generator)
        }

    def change(self, kind: type = object) -> str:
        """What is different now, in words; only values of this kind count."""
        for name, value in vars(self.part).items():
            if isinstance(value, kind) and not _same(value, self.before.get(name, self)):
                return f"it changes its {name}"
        for name, (generator, state) in self.random.items():
            if kind is object and str(generator.state) != str(state):
                return f"it draws from its {name}"
        return ""

    def restore(self) -> None:
        """Back to what was."""
        vars(self.part).clear()
        vars(self.part).update(self.before)
        for generator, state in self.random.values():
            generator.state = state


def _same(a: Any, b: Any) -> bool:
    return a is b or (type(a) is type(b) and isinstance(a, PLAIN) and bool(a == b))
