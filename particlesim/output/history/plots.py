"""A picture of a history: conserved quantities and errors over time, a panel each."""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from ... import validate
from .. import files
from .writer import Record, read_history

FORMATS = (".png", ".svg", ".pdf")
LABELLED = 8  # curves of a panel that are named in its legend
OWNER = "plot_history"


@dataclass
class Panel:
    """What one set of axes shows: curves by label, each (frames, worlds)."""

    title: str
    unit: str
    curves: dict[str, np.ndarray] = field(default_factory=dict)
    logarithmic: bool = False


def energy(record: Record) -> Panel:
    """Kinetic, potential and total energy."""
    names = ("kinetic", "potential", "energy")
    return Panel("energy", "energy", {name: record[name] for name in names})


def drift(record: Record) -> Panel:
    """Change of the energy since the start, over the largest kinetic energy of the world."""
    total = record["energy"]
    change, scale = total - total[:1], record["kinetic"].max(axis=0, initial=0.0)
    ratio = np.divide(change, scale, out=np.zeros_like(change), where=scale > 0)
    return Panel("energy drift", "change / largest kinetic energy", {"drift": ratio})


def momentum(record: Record) -> Panel:
    """Change of the momentum since the start."""
    return _changes(record, "momentum", "mass length / time")


def angular_momentum(record: Record) -> Panel:
    """Change of the angular momentum about the origin since the start."""
    return _changes(record, "angular_momentum", "mass length² / time")


def potential(record: Record) -> Panel:
    """Potential energy of each interaction."""
    return Panel("potential energy", "energy", _family(record, "potential:"))


def temperature(record: Record) -> Panel:
    """2 K / (3 n)."""
    return Panel("temperature", "energy", _family(record, "temperature"))


def pressure(record: Record) -> Panel:
    """Of a periodic box."""
    return Panel("pressure", "energy / length³", _family(record, "pressure"))


def volume(record: Record) -> Panel:
    """Of a box that a barostat scales."""
    return Panel("volume", "length³", _family(record, "volume"))


def stress(record: Record) -> Panel:
    """Of a periodic box, as a pressure."""
    return Panel("stress", "energy / length³", _family(record, "stress_"))


def observed(record: Record) -> Panel:
    """What the run was asked to observe."""
    return Panel("observed", "", _family(record, "observed:"))


def density(record: Record) -> Panel:
    """Largest and root mean square of rho / rho0 - 1."""
    curves = _family(record, "density_error_")
    return Panel("density error ρ/ρ₀ - 1", "", curves)


def residual(record: Record) -> Panel:
    """Largest and root mean square of what constraints are missed by."""
    curves = _family(record, "residual_")
    positive = any((each > 0).any() for each in curves.values())
    return Panel("constraint residual", "|C|", curves, logarithmic=positive)


PANELS: dict[str, Callable[[Record], Panel]] = {
    each.__name__: each
    for each in (
        energy, drift, momentum, angular_momentum, potential, temperature, pressure, stress,
        volume, density, residual, observed,
    )
}  # fmt: skip


def plot_history(
    history: Record | str | os.PathLike[str],
    path: str | os.PathLike[str],
    what: Sequence[str] | None = None,
    *,
    overwrite: bool = False,
) -> list[str]:
    """Draw a history: a panel each for what is asked for, worlds as lines.

    Args:
        history: The file, or what :func:`~particlesim.read_history` made of it.
        path: The picture, ``.png``, ``.svg`` or ``.pdf``.
        what: Of ``"energy"``, ``"drift"``, ``"momentum"``, ``"angular_momentum"``,
            ``"potential"``, ``"temperature"``, ``"pressure"``, ``"density"``, ``"residual"``,
            ``"observed"``; None: all that the history has.
        overwrite: Replace an existing picture.

    Returns:
        The names of the panels.

    Raises:
        ValueError: Another name or suffix, a history without frames, or without what is asked for.
        FileExistsError: The picture exists. ImportError: matplotlib is missing.

    Example:
        >>> from particlesim import Scene, Settings, Simulation
        >>> scene = Scene()
        >>> ball = scene.add_particles([(0, 0, 0)], velocity=(2, 0, 0))
        >>> sim = Simulation(scene, Settings(dt=0.1), device="cpu")
        >>> sim.run(3, history="ball.csv")
        >>> plot_history("ball.csv", "ball.png", ["energy", "momentum"])
        ['energy', 'momentum']
    """
    target = files.check_new(OWNER, path, overwrite, suffixes=FORMATS)
    record = history if isinstance(history, Record) else read_history(history)
    panels = chosen(record, what)
    drawn = figure(record, list(panels.values()))
    with files.whole(OWNER, target) as part:
        drawn.savefig(part, format=target.suffix.lower()[1:], dpi=150)
    return list(panels)


def chosen(record: Record, what: Sequence[str] | None) -> dict[str, Panel]:
    """The panels that are asked for, by name; None: all that have something to show."""
    if not len(record.frame):
        raise validate.fail(OWNER, "history", "have a frame", "none", "run something first")
    for name in what or ():
        validate.choice(OWNER, "what", name, PANELS)
    panels = {name: PANELS[name](record) for name in what or PANELS}
    empty = [name for name, panel in panels.items() if not panel.curves]
    if what is not None and empty:
        raise validate.fail(
            OWNER, "what", "name something that the run recorded", empty[0],
            "leave it out: the scene has none",
        )  # fmt: skip
    return {name: panel for name, panel in panels.items() if panel.curves}


def figure(record: Record, panels: Sequence[Panel]) -> Any:
    """A matplotlib figure of the panels, one below the other."""
    # A Figure of its own needs no display.
    Figure = validate.installed(OWNER, "matplotlib.figure", "plot").Figure
    drawn = Figure(figsize=(7.0, 0.6 + 2.2 * len(panels)), layout="constrained")
    axes = drawn.subplots(len(panels), sharex=True, squeeze=False)[:, 0]
    for each, panel in zip(axes, panels, strict=True):
        _draw(each, record, panel)
    axes[-1].set_xlabel("time")
    return drawn


def _draw(axes: Any, record: Record, panel: Panel) -> None:
    worlds = record.world_count
    for k, (label, values) in enumerate(panel.curves.items()):
        for w in range(worlds):
            # One colour a quantity; of many worlds none hides the others.
            axes.plot(
                record.time, values[:, w], color=f"C{k % 10}", linewidth=1.0,
                alpha=max(0.15, worlds**-0.5), label=label if w == 0 else None,
            )  # fmt: skip
    suffix = f", {worlds} worlds" if worlds > 1 else ""
    axes.set_title(panel.title + suffix, fontsize=9, loc="left")
    axes.set_ylabel(panel.unit, fontsize=8)
    if panel.logarithmic:
        axes.set_yscale("log", nonpositive="mask")
    axes.tick_params(labelsize=8)
    axes.grid(True, alpha=0.3)
    if 1 < len(panel.curves) <= LABELLED:
        for line in axes.legend(fontsize=7, loc="best").get_lines():
            line.set_alpha(1.0)


def _changes(record: Record, name: str, unit: str) -> Panel:
    values = record[name]
    change = values - values[:1]
    title = f"change of the {name.replace('_', ' ')}"
    return Panel(title, unit, {axis: change[..., k] for k, axis in enumerate("xyz")})


def _family(record: Record, prefix: str) -> dict[str, np.ndarray]:
    """All columns that start so, labelled by the rest."""
    return {
        name.removeprefix(prefix).replace(":", " "): values
        for name, values in record.values.items()
        if name.startswith(prefix)
    }
