"""Limits of pair forces: what happens where particles come as close as their speed takes them."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import warp as wp

from ..engine.execution.launch import launch
from ..engine.limit import Limit, explicit_step
from ..engine.model import filled
from ..engine.probe import Probe
from ..kernels.engine.loops import Pairs
from ..kernels.engine.packed import AHEAD
from ..kernels.interactions.pair import add_force

POINTS = 1024  # distances at which a law is asked, from the cutoff inwards
NEAREST = 1e-3  # of the cutoff
LARGEST = 1e60  # of forces: squares of what comes of them stay finite
COUPLES = 32  # of particles whose attributes the law is asked with
GAIN = 1e-3  # of its energy that a collision may gain on average
TRIALS, FINER, PHASES = 32, 0.9, 64  # steps tried, each 0.9 of the last; starts within a step
UNTOUCHED = 1e-3 * GAIN  # of its energy: what a force may have done before a collision is followed
ROUNDS = 20_000  # steps that a collision is followed for, about half a second


def collisions(part: Any, probe: Probe) -> list[Limit]:
    """The step at which particles that run into each other gain energy from the integrator.

    The fastest particle meets one of typical speed, in the frame of their world. Laws that do not
    turn particles back say nothing. Of worlds that differ in speed only, the fastest is asked.
    """
    members = part.pairs.members_host
    members = members[probe.inverse_mass[members] > 0]
    worlds = probe.model.world_of[members]  # rising
    edges = np.searchsorted(worlds, np.arange(probe.model.world_count + 1))
    speeds = probe.relative_speed(members)
    fastest: dict[Any, tuple[float, int]] = {}
    for w, peer in enumerate(part.peers):
        own = speeds[edges[w] : edges[w + 1]]
        if len(own) > 1:
            speed = float(own.max() + np.sqrt((own**2).mean()))
            # Values of particles may differ in any way: then every world is asked.
            alike = (
                w
                if part.quantities - {"position"}
                else _alike(peer, probe, members[edges[w] : edges[w + 1]])
            )
            fastest[alike] = max(fastest.get(alike, (0.0, w)), (speed, w))
    found = []
    for speed, w in fastest.values():
        limit = _of_world(part, probe, w, members[edges[w] : edges[w + 1]], speed)
        found += [] if limit is None else [limit]
    return [min(found, key=lambda limit: limit.dt)] if found else []


def _alike(peer: Any, probe: Probe, rows: np.ndarray) -> tuple[Any, ...]:
    """What worlds have in common whose collisions differ by nothing but speed."""
    values = {name: np.asarray(value).tolist() for name, value in peer.parameters.items()}
    return (peer.cutoff, str(values), float(probe.inverse_mass[rows].max()))


def _of_world(part: Any, probe: Probe, w: int, members: np.ndarray, speed: float) -> Limit | None:
    if speed == 0.0:
        return None
    couples = _couples(part, probe, members)
    mass = 1.0 / probe.inverse_mass[couples].sum(axis=1)
    r = part.peers[w].cutoff * np.geomspace(1.0 - 1e-6, NEAREST, POINTS)
    F = forces(part, probe, w, couples, r)
    rates = [stiffest(r, F[k], 0.5 * mass[k] * speed**2) / mass[k] for k in range(len(couples))]
    k = int(np.argmax(rates))
    if not rates[k] > 0:
        return None
    dt = largest_step(r, F[k] / mass[k], speed, explicit_step(rates[k]))
    dt /= probe.loop.integrator.reach()
    reason = f"two that meet at {speed:.4g} gain {GAIN:.1%} of their energy on average"
    place = probe.place(int(couples[k, 0])) if part.quantities else (w, None)
    return Limit(part.name, "collision", dt, reason, *place)


def stiffest(r: np.ndarray, F: np.ndarray, energy: float) -> float:
    """Largest -dF/dr from the cutoff inwards to where the work done is the energy; or 0.

    Args:
        r: (k,) falling distances. F: (k,) forces there, positive where they repel.
        energy: Of the two in the frame of their centre of mass.
    """
    work = np.concatenate([[0.0], np.cumsum(0.5 * (F[1:] + F[:-1]) * (r[:-1] - r[1:]))])
    beyond = np.nonzero(work > energy)[0]
    last = int(beyond[0]) + 1 if len(beyond) else len(r)
    if last < 3 or (not len(beyond) and F[-1] < 0):
        return 0.0  # attracted all the way
    # At the first, a force that is cut off jumps: that is no stiffness.
    return float(-np.gradient(F, r)[2:last].min(initial=0.0))


def largest_step(r: np.ndarray, a: np.ndarray, speed: float, most: float) -> float:
    """Largest dt, up to ``most``, below which a collision gains at most ``GAIN`` of its energy.

    Two particles meet head-on under the acceleration a(r) of their distance, by the steps of the
    integrator (v += a dt; r += v dt, which both integrators make but for where they call v the
    velocity), from many starts within a step. The linear limit 2 / omega does not see that a step
    may carry them past where they should turn, from where they are thrown back too fast. They are
    followed from where the force begins to tell: slow ones would long fly freely before.
    """
    dt = most * FINER ** np.arange(TRIALS - 1, -1, -1)[:, None]
    done = np.cumsum(0.5 * np.abs(a[1:] + a[:-1]) * (r[:-1] - r[1:]))
    edge = r[np.searchsorted(done, 0.5 * UNTOUCHED * speed**2)]
    x = edge + speed * dt * (np.arange(PHASES) + 0.5) / PHASES
    v = np.full_like(x, -speed)
    for _ in range(min(int(4.0 * edge / (speed * dt[0, 0])) + 2, ROUNDS)):
        near = np.interp(np.abs(x), r[::-1], a[::-1], right=0.0)
        v = v + np.where(x < 0, -near, near) * dt
        x = x + v * dt
        if ((np.abs(x) > edge) & (x * v > 0)).all():
            break
    gained = ((v / speed) ** 2).mean(axis=1) > 1.0 + GAIN
    return float(dt[max(int(np.argmax(gained)) - 1, 0), 0]) if gained.any() else most


def _couples(part: Any, probe: Probe, members: np.ndarray) -> np.ndarray:
    """Pairs to ask the law with, (k, 2): the two lightest, and some more if they are not alike."""
    lightest = members[np.argsort(-probe.inverse_mass[members], kind="stable")[:2]]
    if not part.quantities and not part.chosen.kinds:
        return lightest[None, :]
    rng = np.random.default_rng(0)
    others = [rng.choice(members, 2, replace=False) for _ in range(COUPLES - 1)]
    return np.array([lightest, *others])


def forces(part: Any, probe: Probe, w: int, couples: np.ndarray, r: np.ndarray) -> np.ndarray:
    """F(r) of each couple by the part's own kernel, (couples, distances).

    Every couple at every distance is two slots that have each other for their only neighbour.
    """
    model, precision = part.model, part.model.precision
    count = len(couples) * len(r)
    particle = np.repeat(couples, len(r), axis=0).ravel()
    x = np.zeros((2 * count, 3))
    x[1::2, 0] = np.tile(r, len(couples))
    slots = np.arange(2 * count)
    pairs = Pairs()
    pairs.order = model.array(slots, wp.int32)
    pairs.world = model.array(np.full(2 * count, w), wp.int32)
    size = 2 if model.vectorised else 1
    first = slots[::size]
    pairs.lead = model.array(np.append(first, 2 * count), wp.int32)
    pairs.cluster = model.array(slots // size, wp.int32)
    pairs.count = model.array(np.full(len(first), 2), wp.int32)
    pairs.index = model.array(np.append(slots, np.zeros(AHEAD)), wp.int32)
    pairs.row, pairs.entry_stride = model.array(first // 2 * 2, wp.int64), 1
    room = np.zeros((2 * count + 1, 3), dtype=precision.numpy)
    room[:-1] = x
    fields = {"x": model.array(room, precision.vec3)[:-1], "slot": model.array(slots, wp.int32)}
    for name in part.quantities - {"position"}:
        source = probe.state[name]
        fields[name] = model.array(source.numpy()[particle], source.dtype)
    fields |= part.chosen.of(particle)
    f = wp.zeros(2 * count, dtype=precision.vec3, device=model.device)
    listed = SimpleNamespace(
        pairs=pairs, partners=part.pairs.partners,
        sum=lambda kernel, inputs: launch(kernel, len(first), inputs, model.device),
    )  # fmt: skip
    loop = replace(part.loop, pairs=listed, data=filled(part.loop.Data, fields))
    loop.sum(part.term, add_force, {"f": f})
    values = f.numpy()[1::2, 0].astype(np.float64).reshape(len(couples), len(r))
    return np.clip(np.nan_to_num(values), -LARGEST, LARGEST)
