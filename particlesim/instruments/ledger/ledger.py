"""Ledger: where the energy and the momentum of every world have come from and gone to."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from ... import validate
from ...engine.report import Report
from .accounts import Accounts


@dataclass(frozen=True)
class Entry:
    """One interaction, constraint or thermostat, whose work is the heat it gave, since the start.

    A barostat is among the thermostats: its work is what it did to the velocities. What it did to
    the potential energy is the rest of the change of the energy, that which nobody's heat explains.

    work (worlds,) [J]; impulse (worlds, 3) [N s]; angular_impulse about the origin (worlds, 3)
    [N m s]; float64. kind: ``"interaction"``, ``"constraint"`` or
    ``"thermostat"``.
    """

    name: str
    kind: str
    work: np.ndarray
    impulse: np.ndarray
    angular_impulse: np.ndarray


@dataclass(frozen=True, repr=False)
class Ledger(Report):
    """What every interaction and constraint has done to the particles that are not pinned.

    ``ledger[name]`` is the :class:`Entry` of that name; the second of a name has `` 2`` behind it.
    ``kinetic_change`` (worlds,), ``momentum_change`` and ``angular_momentum_change`` (worlds, 3)
    are those since the start, without what was written from outside. ``str()`` makes the table,
    summed over worlds. The definitions are in :mod:`particlesim.instruments.ledger.accounts`.

    Example:
        >>> from particlesim import Scene, Settings, Simulation, UniformGravity
        >>> scene = Scene()
        >>> stone = scene.add_particles([(0, 2, 0)], mass=3.0)
        >>> gravity = scene.add_interaction(UniformGravity((0, -10, 0)))
        >>> sim = Simulation(scene, Settings(dt=0.5, ledger=True), device="cpu")
        >>> sim.step()
        >>> ledger = sim.ledger()  # v = g t = 5, so 3 v^2 / 2 = 37.5
        >>> ledger["UniformGravity"].work.round(4).tolist()
        [37.5]
        >>> ledger["UniformGravity"].impulse.round(4).tolist()
        [[0.0, -15.0, 0.0]]
    """

    entries: tuple[Entry, ...]
    kinetic_change: np.ndarray
    momentum_change: np.ndarray
    angular_momentum_change: np.ndarray

    @property
    def unaccounted(self) -> np.ndarray:
        """Change of the kinetic energy that no part's work accounts for: round-off [J]."""
        return self.kinetic_change - np.sum([each.work for each in self.entries], axis=0)

    @property
    def unaccounted_momentum(self) -> np.ndarray:
        """Change of the momentum that no part's impulse accounts for: round-off [N s]."""
        return self.momentum_change - np.sum([each.impulse for each in self.entries], axis=0)

    def __getitem__(self, name: str) -> Entry:
        names = [each.name for each in self.entries]
        validate.choice("Ledger", "name", name, names)
        return self.entries[names.index(name)]

    def __iter__(self) -> Iterator[Entry]:
        return iter(self.entries)

    def __str__(self) -> str:
        rows = [(each.name, each.work.sum(), each.impulse.sum(axis=0)) for each in self.entries]
        changed, left = self.momentum_change.sum(axis=0), self.unaccounted_momentum.sum(axis=0)
        total = [
            ("kinetic energy, momentum", self.kinetic_change.sum(), changed),
            ("unaccounted", self.unaccounted.sum(), left),
        ]
        width = max(len(name) for name, _, _ in [*rows, *total])
        worlds = len(self.kinetic_change)
        head = f"{'since the start' + (f', {worlds} worlds' if worlds > 1 else ''):<{width}}"
        lines = [f"{head}  {'work [J]':>12}  {'impulse [N s]':>38}"]
        lines += [_line(*row, width) for row in rows]
        lines.append("-" * len(lines[0]))
        return "\n".join(lines + [_line(*row, width) for row in total])


def _line(name: str, work: float, impulse: np.ndarray, width: int) -> str:
    return f"{name:<{width}}  {work:12.5g}  " + " ".join(f"{each:12.5g}" for each in impulse)


def read(accounts: Accounts | None) -> Ledger:
    """The ledger that accounts make (see :meth:`Simulation.ledger`)."""
    if accounts is None:
        raise validate.fail(
            "Simulation.ledger", "settings.ledger", "be True from the start", False,
            "use Settings(ledger=True)",
        )  # fmt: skip
    used: Counter[str] = Counter()
    entries = []
    for account, sums in zip(accounts.accounts, accounts.sums(), strict=True):
        name = account.part.name
        used[name] += 1
        if used[name] > 1:
            name = f"{name} {used[name]}"
        entries.append(Entry(name, account.kind, sums[:, 0], sums[:, 1:4], sums[:, 4:7]))
    change = accounts.change()
    return Ledger(tuple(entries), change[:, 0], change[:, 1:4], change[:, 4:7])
