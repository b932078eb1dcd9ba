"""Shape matching: clusters of particles that keep their shape, rigid or soft."""

from __future__ import annotations

from typing import Any

import numpy as np
import warp as wp

from ... import validate
from ...engine import topology
from ...engine.execution.launch import launch
from ...engine.model import Model
from ...engine.neighbors.lists import Neighbors
from ...engine.state import State
from ...kernels.constraints.clusters import cluster_motion as motion
from ...kernels.constraints.clusters.members import Form
from ...kernels.constraints.clusters.shape_matching import project_kernels
from ..tuples import bodies
from .implicit import ImplicitClusters
from .members import Members, checked, colors


class ShapeMatching(ImplicitClusters):
    r"""Clusters keep their shape: rigid bodies, and soft ones that are pulled back to it.

    Every member goes to its goal c + R q, q its place in the rest shape from the centre of mass,
    c the present centre (Mueller et al. 2005, eq. 7). The rotation R solves

        sum m (x_prev - c_prev) x (c + R q - x) = 0,

    so that the impulses of a substep have no torque about the places where it began: momentum and
    angular momentum are kept to round-off. For a free rigid body this is the method of Moser and
    Veselov (1991), of second order and symplectic. Where a body turns by more than about a radian
    in a substep nothing solves it: R is then the rotation nearest to the present shape (Horn
    1987), and the angular momentum that is missing is given back to the velocities.

    A soft cluster pulls with m_i / (mean m) / compliance times the offset at each member; the
    result does not depend on the number of iterations. Members may be in several clusters, which
    are solved one after the other. Pinned members hold theirs: one is a pivot, two are an axis.

    Args:
        clusters: One list of particle indices, or a Group, for each; at least 2 particles.
        compliance: alpha, of a member of mean mass [length / force], one or one a cluster, at
            least 0; 0: rigid.
        rest: Rest shapes, (k, 3) places for the members of each cluster [length]; None: as they
            are at the start.
        yield_strain: |S - 1| (Frobenius) of the stretch S beyond which the rest shape flows, at
            least 0, one or one a cluster; None: never.
        creep: How fast it flows, at least 0 [1 / time].
        largest_strain: How far it flows, |S_p - 1|, at least 0.
        break_force: Force on a member beyond which a cluster is gone for good [force], one or one
            a cluster, above 0; None: unbreakable.

    Raises:
        ValueError: Clusters of fewer than 2 particles, with one of them twice or out of range;
            rest shapes of other sizes; values out of range.

    Example:
        >>> from particlesim import Scene, Settings, Simulation, sample
        >>> scene = Scene()
        >>> brick = scene.add_particles(sample.box((0, 0, 0), (2, 1, 1), 1.0), velocity=(1, 0, 0))
        >>> body = scene.add_constraint(ShapeMatching([brick]))
        >>> sim = Simulation(scene, Settings(dt=0.5), device="cpu")
        >>> sim.step()
        >>> (sim.position - scene.position).round(5).tolist()
        [[0.5, 0.0, 0.0], [0.5, 0.0, 0.0]]
    """

    requires = frozenset({"position", "velocity", "inverse_mass", "correction"})

    def __init__(
        self, clusters: Any, compliance: Any = 0.0, *, rest: Any = None, yield_strain: Any = None,
        creep: float = 1.0, largest_strain: float = 1.0, break_force: Any = None,
    ):  # fmt: skip
        name = self.name
        self.clusters = checked(name, clusters)
        count = len(self.clusters)
        self.compliance = topology.per_item(name, "compliance", compliance, count, minimum=0)
        self.rest = None if rest is None else self._shapes(rest)
        self.yield_strain = (
            None if yield_strain is None
            else topology.per_item(name, "yield_strain", yield_strain, count, minimum=0)
        )  # fmt: skip
        self.creep = validate.number(name, "creep", creep, minimum=0.0, unit="1/time")
        self.largest_strain = validate.number(name, "largest_strain", largest_strain, minimum=0.0)
        self.break_force = (
            None
            if break_force is None
            else topology.limits(name, "break_force", break_force, count)
        )

    def _shapes(self, rest: Any) -> list[np.ndarray]:
        if len(rest) != len(self.clusters):
            raise validate.fail(
                self.name, "rest", f"hold a shape for each of {len(self.clusters)} clusters",
                len(rest), "give one for each",
            )  # fmt: skip
        return [
            validate.rows(self.name, f"rest[{n}]", shape, len(row), 3)
            for n, (shape, row) in enumerate(zip(rest, self.clusters, strict=True))
        ]

    def kind(self) -> tuple[Any, ...]:
        return type(self), self.yield_strain is None, self.break_force is None

    @property
    def rigid_bodies(self) -> bool:  # type: ignore[override]
        return bool((self.compliance == 0).any())

    # The engine's side ------------------------------------------------------------------------

    @property
    def breakable(self) -> bool:
        return self.break_force is not None

    def prepare(self, model: Model, neighbors: Neighbors) -> None:
        self.model = model
        clusters = [peer.clusters for peer in self.peers]
        shapes = [peer.rest for peer in self.peers]
        self.members = Members(self.name, model, clusters, shapes, colors(clusters))
        self.count = self.members.count

    def _column(self, name: str) -> np.ndarray:
        """A parameter of all clusters in the order of the arrays."""
        return np.concatenate([getattr(peer, name) for peer in self.peers])[self.members.order]

    def attach(self, model: Model, state: State) -> None:
        if not self.count:
            return
        members = self.members
        breakable, plastic = self.breakable, self.yield_strain is not None
        self.bodies = bodies(model, state)
        limit = self._column("break_force") if breakable else np.zeros(0)
        softness = self._column("compliance") * members.mean
        self.rigid = softness == 0
        self.struct = members.struct(softness, limit, breakable)
        self.form = Form(
            model.precision, model.periodic, "position_error" in state, plastic, breakable
        )
        self.kernels = project_kernels(self.form)
        self.largest = wp.zeros(self.count, dtype=wp.float64, device=model.device)
        chunks = len(self.struct.moments)
        self.rates = wp.zeros(chunks, dtype=motion.Rates, device=model.device)
        self.motion = wp.zeros(self.count, dtype=motion.RigidMotion, device=model.device)
        self.fresh = True
        if plastic:
            self._prepare_flow()

    def _prepare_flow(self) -> None:
        model, spread = self.model, self.members.spreads()
        inverse = np.linalg.pinv(spread, rcond=1e-9, hermitian=True)
        flat = np.eye(3) - np.einsum("kij,kjl->kil", spread, inverse)
        own = [(peer.creep, peer.largest_strain) for peer in self.peers]
        flow = np.column_stack([self._column("yield_strain"), np.array(own)[self.members.world]])
        self.flow = [model.array(inverse, wp.mat33d), model.array(flat, wp.mat33d),
                     model.array(flow, wp.vec3d)]  # fmt: skip

    def project(self, state: State, neighbors: Neighbors, dt: float) -> None:
        if not self.count or dt <= 0:
            return
        fresh, own, timed = self._timing(dt)
        device, box, c, b = self.model.device, self.model.box, self.struct, self.bodies
        for start, end, first, last in self.members.spans:
            if last - first == end - start:  # each is one chunk
                inputs = [start, fresh, own, 1.0 / dt, timed, box, c, b]
                launch(self.kernels.whole, end - start, inputs, device)
                continue
            launch(self.kernels.add_up, last - first, [first, own, timed, box, c, b], device)
            launch(self.kernels.match, end - start, [start, fresh, 1.0 / dt, c, b], device)
            launch(self.kernels.draw, last - first, [first, fresh, 1.0 / dt, box, c, b], device)

    def finish(self, state: State, neighbors: Neighbors, dt: float) -> None:
        if not self.count or dt <= 0:
            return
        device, box, c, b = self.model.device, self.model.box, self.struct, self.bodies
        for start, end, first, last in self.members.spans:
            inputs = [start, 1.0 / dt, box, c, b]
            launch(motion.spin_kernel(self.form), end - start, inputs, device)
            if self.form.plastic:
                launch(self.kernels.add_up, last - first, [first, dt, 1.0, box, c, b], device)
                launch(
                    motion.creep_kernel(self.form), end - start, [start, dt, *self.flow, c], device
                )
        super().finish(state, neighbors, dt)

    def _strain(self, may_break: int, dt: float) -> wp.array:
        """The largest force on a member of each cluster."""
        inputs = [may_break, self.struct, (1.0 / dt) ** 2, self.largest]
        launch(motion.strain_kernel(self.form), self.count, inputs, self.model.device)
        return self.largest

    def bounce(self, state: State, neighbors: Neighbors, bounces: Any, dt: float) -> None:
        """Velocities of rigid clusters become rigid, with the same momentum and angular momentum.

        What members have bounced off by goes to all of their cluster so.
        """
        if not self.count or not self.rigid.any():
            return
        device, c, b = self.model.device, self.struct, self.bodies
        add_up, fit, follow = (
            kernel(self.form)
            for kernel in (motion.velocities_kernel, motion.fit_kernel, motion.follow_kernel)
        )
        for start, end, first, last in self.members.spans:
            seen = [self.model.box, c, b, first]
            launch(add_up, last - first, [*seen, self.rates], device)
            launch(fit, end - start, [c, b, start, self.rates, self.motion], device)
            launch(follow, last - first, [*seen, self.motion, bounces], device)

    def measure_stress(self, state: State, energy: wp.array, stress: wp.array) -> bool:
        """Add the virial of the last substep's forces, and the energy of soft clusters."""
        dt = self.model.settings.substep
        if self.count and dt > 0:
            for start, end, _, _ in self.members.spans:
                inputs = [start, (1.0 / dt) ** 2, self.model.box, self.struct, self.bodies]
                kernel = motion.virial_kernel(self.form)
                launch(kernel, end - start, [*inputs, energy, stress], self.model.device)
        return True

    def persistent(self) -> dict[str, wp.array]:
        if not self.count:
            return {}
        names = ["turn"] + ["strain"] * self.form.plastic + ["broken"] * self.form.breakable
        return {name: getattr(self.struct, name) for name in names}

    def readable(self) -> dict[str, wp.array]:
        return {"shift": self.struct.shift, "origin": self.struct.origin} if self.count else {}

    def worlds(self, name: str, array: wp.array) -> np.ndarray | None:
        if name == "shift":
            return np.repeat(self.members.world, [len(row) for row in self.members.particles])
        return self.members.world
