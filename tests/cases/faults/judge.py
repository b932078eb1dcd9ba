"""What becomes of a scene: right, told, refused, or nonsense in silence."""

import re
import warnings
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np

import particlesim as ps

RIGHT, TOLD, REFUSED, SILENT = "right", "told", "refused", "silent nonsense"
HOUSE = re.compile(r"\w[\w. ]*: .+ must .+, got .*; .+\.", re.DOTALL)  # the form of an error


@dataclass(frozen=True)
class Row:
    """A scene, how it is run, and how far off its motion may be.

    Args:
        name: What it is.
        build: Makes the scene.
        miss: Of a run, how far it is off, in parts of what is allowed: right up to 1.
        frames: To run.
        knobs: Of the settings.
        act: Does something with the simulation before each frame, of (simulation, frame).
        names: What a warning or an error has to name, a pattern.
        worlds: Of the batch; None: of a single scene.
        slow: Takes long.
    """

    name: str
    build: Callable[[], Any]
    miss: Callable[["Run"], float]
    frames: int = 60
    knobs: dict[str, Any] = field(default_factory=dict)
    act: Callable[[Any, int], None] | None = None
    names: str = ""
    worlds: int | None = None
    slow: bool = False


@dataclass
class Run:
    """Frames of a run: times (f + 1,), positions and velocities (f + 1, n, 3), diagnostics."""

    row: Row
    sim: Any = None
    times: Any = None
    x: Any = None
    v: Any = None
    sums: list[Any] = field(default_factory=list)

    @property
    def energy(self):
        """(f + 1, worlds)."""
        return np.array([each.energy for each in self.sums])

    @property
    def kinetic(self):
        """(f + 1, worlds)."""
        return np.array([each.kinetic for each in self.sums])

    @property
    def momentum(self):
        """(f + 1, worlds, 3)."""
        return np.array([each.momentum for each in self.sums])


def run(row, *, sums=True, **knobs):
    """The motion of a row, with some knobs changed."""
    result = Run(row)
    sim = ps.Simulation(row.build(), ps.Settings(**{**row.knobs, **knobs}), "cpu", row.worlds)
    result.sim = sim
    times, x, v = [], [], []
    for frame in range(row.frames + 1):
        times.append(sim.time)
        x.append(sim.state.unwrapped())
        v.append(sim.get("velocity").astype(float))
        if sums:
            result.sums.append(sim.diagnostics())
        if frame < row.frames:
            if row.act is not None:
                row.act(sim, frame)
            sim.run(1)
    result.times, result.x, result.v = np.array(times), np.array(x), np.array(v)
    return result


def verdict(row):
    """(verdict, what was told or by how much it was missed)."""
    with warnings.catch_warnings(record=True) as said:
        warnings.simplefilter("always")
        try:
            done = run(row)
        except (ValueError, TypeError, ps.SimulationError) as error:
            done = error
    told = [str(each.message) for each in said if issubclass(each.category, UserWarning)]
    named = [text for text in told if re.search(row.names, text)]
    if named:
        return TOLD, named[0]
    if isinstance(done, Exception):
        text = str(done)
        named = HOUSE.fullmatch(text) and re.search(row.names, text)
        return (REFUSED if named else SILENT), text
    miss = row.miss(done)
    note = f"off by {miss:.3g} of what is allowed" + "".join(f"; {text}" for text in told)
    return (RIGHT if miss <= 1.0 and not told else SILENT), note


# How far off a run is ----------------------------------------------------------------------------


def whole(value):
    """``value``; infinite where it is not a number."""
    return float(value) if np.isfinite(value) else np.inf


def path(exact, part=0.1):
    """Off the exact path, of times (f,) to positions (f, n, 3), by parts of how far that goes."""

    def miss(done):
        true = exact(done.times)
        size = np.ptp(true, axis=(0, 1)).max()
        return whole(np.abs(done.x - true).max() / (part * size))

    return miss


def as_fine(by=64, part=0.1, **knobs):
    """Off the path of the same scene in double precision with ``by`` times the substeps."""

    def miss(done):
        substeps = done.sim.settings.substeps * by
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            true = run(done.row, sums=False, substeps=substeps, precision="float64", **knobs).x
        size = np.ptp(true, axis=(0, 1)).max()
        return whole(np.abs(done.x - true).max() / (part * size))

    return miss


def energy_kept(part=0.1, least=0.0):
    """Off in energy, by parts of the largest kinetic energy, or of ``least``."""

    def miss(done):
        energy, scale = done.energy, max(done.kinetic.max(), least)
        return whole(np.abs(energy - energy[0]).max() / (part * scale))

    return miss


def trend_kept(part=0.1, least=0.0):
    """Off in the mean energy of the last quarter from that of the first, as :func:`energy_kept`.

    What a method of steps this large makes swing, but keeps, is left out.
    """

    def miss(done):
        energy, scale = done.energy, max(done.kinetic.max(), least)
        quarter = max(1, len(energy) // 4)
        change = energy[-quarter:].mean(axis=0) - energy[:quarter].mean(axis=0)
        return whole(np.abs(change).max() / (part * scale))

    return miss


def momentum_kept(part=0.1):
    """Off in momentum, by parts of the largest that any particle has."""

    def miss(done):
        m = done.sim.state.held("mass").numpy()[:, None]
        scale = (m * np.abs(done.v)).max()
        return whole(np.abs(done.momentum - done.momentum[0]).max() / (part * scale))

    return miss


def within(size, factor=3.0, center=(0.0, 0.0, 0.0)):
    """Farther from the center than ``factor`` times ``size``."""
    return lambda done: whole(np.abs(done.x - np.array(center)).max() / (factor * size))


def slower_than(speed, factor=3.0):
    """Faster than ``factor`` times a speed."""
    return lambda done: whole(np.linalg.norm(done.v, axis=2).max() / (factor * speed))


def equal(value, expected, part=0.1, scale=None):
    """Off in one number of the run, by parts of ``scale`` or of itself."""
    size = abs(expected) if scale is None else scale
    return lambda done: whole(np.abs(value(done) - expected) / (part * size))


def never(done):
    """Nothing but a word is right."""
    return np.inf


# Scenes ------------------------------------------------------------------------------------------


def scene(x, *parts, box=None, **particles):
    """A scene of particles and parts."""
    made = ps.Scene(periodic=box)
    made.add_particles(x, **particles)
    for part in parts:
        (made.add_constraint if hasattr(part, "project") else made.add_interaction)(part)
    return made


EULER, VERLET = {"integrator": "symplectic_euler"}, {"integrator": "velocity_verlet"}
