"""Conserved quantities of every world, summed on the device when asked for."""

from __future__ import annotations

import contextlib
import weakref
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import warp as wp

from ..engine.blocks import blocks
from ..engine.execution.launch import launch
from ..engine.loop import Loop
from ..engine.model import Model
from ..engine.report import Report, grid
from ..engine.source import Source
from ..kernels.instruments.sums import QUANTITIES, block_sums_kernel
from ..kernels.precision import FLOAT64
from ..kernels.tensor import Tensor, matrices
from .residuals import worst

SHOWN = 20  # worlds of a table
BLOCK = 256  # particles summed by one thread
MEASURED = ("density", "pressure", "smoothing_length")  # found with the forces


@dataclass(frozen=True, repr=False)
class Diagnostics(Report):
    """Sums over the particles of each world, float64. ``str()`` makes a table.

    mass (worlds,), momentum (worlds, 3) and angular_momentum about the origin (worlds, 3);
    kinetic and potential energy, their sum ``energy``, and the virial sum of r.F over pairs,
    (worlds,), to which constraints between particles and contacts add that of the last substep.
    Pinned particles count in the mass and the potential energy only; ``free`` is how many are not,
    and ``volume`` that of the periodic box, not a number where an axis is open, (worlds,).

    ``stress`` is the pressure as a tensor, P_ab V = sum m v_a v_b + sum r_a F_b (Irving and
    Kirkwood 1950), of which the mean of the diagonal is ``pressure``: positive where it pushes, as
    minus the stress of solids, symmetric, (worlds, 3, 3) [energy/length^3]. It is not a number
    where an axis is open, or where something gives its virial as one number: a fluid, a tree,
    an Ewald sum, contacts.

    ``substeps`` are those of the last frame, and ``limiter`` are the part and the kind of limit
    that they were chosen by, in words, (worlds,), the same for all worlds of a batch; no words
    where they are not adaptive.

    ``density_error`` and ``divergence_error`` are what the last substep of a :class:`DFSPH` has
    left, on average and in parts of the rest density, and ``pressure_iterations`` what it took for
    both, (worlds,); not numbers and 0 in a scene without one.

    ``constraint_error`` is by how much the tuple that is missed most is off, in parts of its
    extent, (worlds,): that of XPBD's residual |C + alpha lam / dt^2| for the last substep's
    multiplier, which goes to 0 with iterations and with substeps; and of a :class:`FluidDensity` by
    what part it is denser than at rest; not a number without any.
    """

    mass: np.ndarray
    momentum: np.ndarray
    angular_momentum: np.ndarray
    kinetic: np.ndarray
    potential: np.ndarray
    virial: np.ndarray
    free: np.ndarray
    volume: np.ndarray
    stress: np.ndarray
    substeps: np.ndarray
    limiter: np.ndarray
    density_error: np.ndarray
    divergence_error: np.ndarray
    pressure_iterations: np.ndarray
    constraint_error: np.ndarray

    @property
    def energy(self) -> np.ndarray:
        """Kinetic plus potential energy."""
        return self.kinetic + self.potential

    @property
    def temperature(self) -> np.ndarray:
        """k T = 2 K / (3 n) of the n particles that are not pinned [energy]; 0 without any.

        All 3 n velocities count, as a thermostat, a wall or a field exchanges momentum. Where
        nothing does and the momentum is zero, three of them are fixed, and the temperature is
        n / (n - 1) of this (Frenkel and Smit 2002, section 4.1.1); a rod fixes one more each.
        """
        return 2.0 * self.kinetic / (3.0 * np.maximum(self.free, 1))

    @property
    def pressure(self) -> np.ndarray:
        """P = (2 K + sum r.F) / (3 V) (Clausius 1870) [energy/length^3], (worlds,).

        Not a number where an axis is open: such a scene has no volume. Fields and boundaries, which
        act from outside, have no part in it.
        """
        return (2.0 * self.kinetic + self.virial) / (3.0 * self.volume)

    def __str__(self) -> str:
        heads = [("world" if len(self.mass) > 1 else "", "right")]
        columns = [[str(w) if len(self.mass) > 1 else "" for w in range(len(self.mass))]]
        for name in ("mass", "kinetic", "potential", "energy", "virial", "temperature", "pressure"):
            heads.append((name, "right"))
            columns.append([f"{value:.6g}" for value in getattr(self, name)])
        for name in ("momentum", "angular_momentum"):
            heads.append((name.replace("_", " "), "left"))
            columns.append([" ".join(f"{x:.5g}" for x in row) for row in getattr(self, name)])
        if self.limiter.any():
            heads += [("substeps", "right"), ("limited by", "left")]
            columns += [[str(n) for n in self.substeps], self.limiter.tolist()]
        rows = list(zip(*columns, strict=True))
        more = [f"and {len(rows) - SHOWN} more worlds"] if len(rows) > SHOWN else []
        return "\n".join([*grid(heads, rows[:SHOWN]), *more])


def measure(sim: Source, potentials: list[np.ndarray] | None = None) -> Diagnostics:
    """The diagnostics of the present state, which stays as it is.

    Energies that leave single precision, as those of planets in SI units do while their motion is
    within it, are computed in double.

    Args:
        sim: The simulation.
        potentials: An empty list, if given, gets the potential energy of each interaction,
            (worlds,).
    """
    found = _measure(sim, sim, potentials)
    if _overflows(sim, found):
        if potentials is not None:
            potentials.clear()
        found = _measure(sim, _doubled(sim), potentials)
    return found


def _overflows(sim: Source, found: Diagnostics) -> bool:
    """Whether energies are not finite where the motion is, in single precision."""
    if np.isfinite(found.energy).all() and np.isfinite(found.virial).all():
        return False
    unchanged = sum(scene.particle_count for scene in sim.scenes) == sim.model.particle_count
    finite = all(np.isfinite(sim.state[name].numpy()).all() for name in ("position", "velocity"))
    return unchanged and finite and sim.model.precision is not FLOAT64


_doubles: weakref.WeakKeyDictionary[Model, Loop] = weakref.WeakKeyDictionary()


def _doubled(sim: Source) -> Loop:
    """The same scenes in double precision, at the present state."""
    if sim.model not in _doubles:
        settings = sim.settings.replace(precision="float64")
        _doubles[sim.model] = Loop(sim.scenes, settings, sim.model.device)
    twin = _doubles[sim.model]
    for name, array in twin.state.arrays.items():
        if name in sim.state:
            array.assign(sim.state[name].numpy())
    return twin


def _measure(sim: Source, forces: Source, potentials: list[np.ndarray] | None) -> Diagnostics:
    """The diagnostics, with the energies of the interactions of ``forces``."""
    model, state, device = sim.model, sim.state, sim.model.device
    energy = wp.zeros(model.particle_count, dtype=wp.float64, device=device)
    virial = wp.zeros_like(energy)  # of what does not know it as a tensor
    stress = wp.zeros(model.particle_count, dtype=Tensor, device=device)
    with undisturbed(forces):
        forces.neighbors.update(forces.state)
        forces.neighbors.grow()
        for constraint in sim.constraints:
            if not constraint.measure_stress(state, energy, stress):
                constraint.measure(state, energy, virial)
        for interaction in forces.interactions:
            before = energy.numpy().copy() if potentials is not None else None
            if not interaction.measure_stress(forces.state, energy, stress):
                interaction.measure(forces.state, energy, virial)
            if potentials is not None:
                own = energy.numpy() - before
                potentials.append(np.bincount(model.world_of, own, model.world_count))
    begin, end, world = blocks(model.offsets, BLOCK)
    sums = wp.zeros((len(begin), QUANTITIES), dtype=wp.float64, device=device)
    launch(
        block_sums_kernel(model.precision),
        len(begin),
        [
            model.array(begin, wp.int32), model.array(end, wp.int32), state.position,
            state.velocity, state.held("mass"), state.held("inverse_mass"), energy, virial, stress,
            sums,
        ],
        device,
    )  # fmt: skip
    total = np.zeros((model.world_count, QUANTITIES))
    np.add.at(total, world, sums.numpy())
    free = np.bincount(model.world_of, model.column("pinned") == 0, model.world_count)
    length = model.box_length
    volume = np.where((length > 0).all(axis=1), length.prod(axis=1), np.nan)
    limiter = f"{sim.limiter.part} {sim.limiter.kind}".strip() if sim.limiter else ""
    known = np.where(total[:, 10] == 0.0, volume, np.nan)[:, None, None]
    return Diagnostics(
        total[:, 0], total[:, 1:4], total[:, 4:7], total[:, 7], total[:, 8], total[:, 9], free,
        volume, matrices(total[:, 11:]) / known,
        np.full(model.world_count, sim.settings.substeps), np.full(model.world_count, limiter),
        *_of_pressures(sim), worst(sim),
    )  # fmt: skip


def _of_pressures(sim: Source) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Errors of density and of divergence, and iterations; of several fluids the most."""
    worlds = sim.model.world_count
    errors = {what: np.full(worlds, np.nan) for what in ("density", "divergence")}
    iterations = np.zeros(worlds, dtype=int)
    for part in sim.interactions:
        found = part.iterated()
        for each in found:
            errors[each.what] = np.fmax(errors[each.what], each.error)
        iterations = np.maximum(iterations, sum(each.iterations for each in found))
    return errors["density"], errors["divergence"], iterations


@contextlib.contextmanager
def undisturbed(sim: Source) -> Iterator[None]:
    """Put back what measuring renews: neighbour rows, whose order decides about rounding, and
    densities and lengths, which belong to the last forces.
    """
    state = sim.state
    kept = {name: wp.clone(state[name]) for name in MEASURED if name in state}
    rows = [
        (each, [(array, wp.clone(array)) for array in each.persistent().values()])
        for each in sim.neighbors.verlet
    ]
    try:
        yield
    finally:
        for name, array in kept.items():
            wp.copy(state[name], array)
        for each, arrays in rows:
            if any(not np.array_equal(now.numpy(), then.numpy()) for now, then in arrays):
                for now, then in arrays:
                    wp.copy(now, then)
                each.mark_all()
                each.rebuild()
