"""Elastic solids by total Lagrangian SPH."""

from __future__ import annotations

from typing import Any

import numpy as np
import warp as wp

from ... import validate
from ...engine.execution.launch import launch
from ...engine.model import Model
from ...engine.neighbors.lists import Neighbors
from ...engine.state import State
from ...kernels.interactions import solid as kernels
from ...scene.part import Interaction
from .links import Rest, at_rest

SPARSE, DENSE = 0.4, 2.5  # of the cells that the nearest make, what fits: closest packings have 0.7


class ElasticSolid(Interaction):
    r"""A solid that follows Hooke's law, however far it is turned: total Lagrangian SPH.

    The particles are linked with those that are within 2 h at the start, where the solid is at
    rest, for good: it neither breaks nor flows nor sticks to what it meets. With X = X_j - X_i
    between them at rest, u = x_j - x_i - X, V the volumes and s = -W'(|X|) / |X|, W being
    Wendland's C2,

        F_i = 1 + (sum_j c u X^T) M_i^-1,  M_i = sum_j c X X^T,  c = V_i V_j s
        E = (F^T F - 1) / 2,   S = lambda tr(E) 1 + 2 mu E

    The gradient F is exact where the deformation is uniform (corrected as Bonet and Lok 1999), and
    S is Saint Venant and Kirchhoff's. The force is minus the gradient of

        U = sum_i V_i (lambda tr(E)^2 / 2 + mu E:E)
            + alpha mu sum_ij c |u - (F_i - 1) X|^2

    whose second term holds what F does not see, hourglasses (Ganzenmueller 2015). Its weights are
    those by which F is the best fit to the u, so that it does not change with F to first order, and
    its gradient has no further term (Silling 2017, for peridynamics):

        f_i = sum_j c ((B_i + B_j) X + 4 alpha mu u),  B = V F S M^-1 - 2 alpha mu (F - 1)

    Forces of a link are opposite, and U does not change when the solid is turned: momentum and
    angular momentum are kept to round-off, energy as well as the integrator does.

    Strains of up to some tens of per cent are well described. Saint Venant and Kirchhoff's solid
    gets softer when it is compressed, and below 0.58 of its length it gives way; where a particle's
    neighbourhood is turned inside out, det F <= 0, the run stops, and says so.

    Near a surface F is that of some h below it. What a beam that bends would lose by that the
    second term gives back at alpha = 1, where what F does not see is as stiff as strain in shear:
    from four particles across it bends by 3 % too much, of which alpha = 0.1 makes 50 %.

    Bodies that are less than 2 h apart at the start are one; make a part for each. Bodies meet each
    other by forces between pairs (``groups`` of :class:`PairPotential`), or by :class:`Contact` of
    particles whose diameter is less than the spacing by as much as the solid may be compressed. A
    liquid feels a body of its own spacing that it is together with in a :class:`SPH`,

        SPH([water, solid], rest_density=[1000.0, 1200.0],
            equation_of_state=[Tait(30.0), Tait(0.03)], smoothing_length=h)

    where the solid's particles count in the liquid's density (as walls of Akinci 2012), and press
    on each other a million times less than it. Pinned particles clamp a solid.

    Args:
        group: The solid's particles; None: all.
        youngs_modulus: Y [pressure], above 0; a force per length in two dimensions.
        poissons_ratio: nu, above -1 and below 0.5.
        smoothing_length: h [length], above 0: about 1.3 spacings or more.
        rest_density: rho_0 [mass/length^d], from which volumes m / rho_0 follow; None: that of
            particles on a square lattice.
        hourglass: alpha, at least 0.
        dissipation: tau [time], at least 0: S answers to E + tau dE/dt (Kelvin and Voigt).
        dimension: 3; 2 for plane strain in x and y.

    Raises:
        ValueError: A value out of range; when a simulation is made, particles that coincide, or
            that have others in a plane alone, or too few.

    Example:
        >>> from particlesim import Scene, Settings, Simulation, sample
        >>> scene = Scene()
        >>> x = sample.box((0, 0, 0), (1, 1, 1), spacing=0.2)
        >>> rubber = scene.add_particles(x, mass=1000 * 0.2**3)
        >>> solid = scene.add_interaction(ElasticSolid(rubber, 1e5, 0.3, smoothing_length=0.3))
        >>> sim = Simulation(scene, Settings(dt=1e-3, precision="float64"), device="cpu")
        >>> sim.position = 1.01 * x  # by (lambda 9 / 2 + 3 mu) E^2, E = 0.01005
        >>> round(float(sim.diagnostics().potential[0]), 2)
        37.88
    """

    follows_box = True

    def __init__(
        self, group: Any, youngs_modulus: float, poissons_ratio: float, *,
        smoothing_length: float, rest_density: float | None = None, hourglass: float = 1.0,
        dissipation: float = 0.0, dimension: int = 3,
    ):  # fmt: skip
        name = self.name
        self.group = group
        if dimension not in (2, 3):
            raise validate.fail(name, "dimension", "be 2 or 3", dimension, "choose one of these")
        self.dimension = dimension
        Y = validate.number(name, "youngs_modulus", youngs_modulus, above=0.0, unit="pressure")
        nu = validate.number(name, "poissons_ratio", poissons_ratio, above=-1.0)
        if nu >= 0.5:
            raise validate.fail(
                name, "poissons_ratio", "be below 0.5", nu, "give 0.49 for what hardly changes its "
                "volume",
            )  # fmt: skip
        hourglass = validate.number(name, "hourglass", hourglass, minimum=0.0)
        if rest_density is not None:
            rest_density = validate.number(
                name, "rest_density", rest_density, above=0.0, unit="mass/length^d"
            )
        self.parameters = {
            "smoothing_length": validate.number(
                name, "smoothing_length", smoothing_length, above=0.0, unit="length"
            ),
            "rest_density": rest_density,
            "lame": Y * nu / ((1.0 + nu) * (1.0 - 2.0 * nu)),
            "shear": Y / (2.0 * (1.0 + nu)),
            "hourglass": hourglass * Y / (1.0 + nu),  # 2 mu alpha
            "dissipation": validate.number(
                name, "dissipation", dissipation, minimum=0.0, unit="time"
            ),
        }
        self.conservative = not dissipation
        self.reads_velocity = not self.conservative
        self.requires = frozenset({"force"} | ({"velocity"} if dissipation else set()))

    def kind(self) -> tuple[Any, ...]:
        return (type(self), self.dimension, self.conservative)

    def prepare(self, model: Model, neighbors: Neighbors) -> None:
        self.model = model
        self.members = model.members([peer.group for peer in self.peers], self.name)
        world = model.world_of[self.members]
        self.of_world = np.split(self.members, np.searchsorted(world, range(1, model.world_count)))
        known: dict[tuple[int, int], Rest] = {}  # copies of a scene are at rest alike
        rest = []
        for w, (peer, members) in enumerate(zip(self.peers, self.of_world, strict=True)):
            key = id(model.scenes[w]), id(peer)
            if key not in known:
                known[key] = at_rest(peer, model, w, members)
            rest.append(known[key])
        self.shares = [each.share for each in rest]
        columns = self.columns(dict.fromkeys(("lame", "shear", "hourglass", "dissipation")))
        model.fits(self.name, columns)
        self.Params, self.params = model.parameters("SolidParameters", columns)
        self.rows = self._rows(_joined(rest), world)

    def _rows(self, host: dict[str, np.ndarray], world: np.ndarray) -> Any:
        """The struct that the kernels take."""
        model, precision = self.model, self.model.precision
        model.fits(self.name, {name: host[name] for name in ("link", "V", "inverse")})
        rows = kernels.solid_type(precision)()
        whole = {"particle": self.members, "world": world, "begin": host["begin"],
                 "other": host["other"]}  # fmt: skip
        for name, column in whole.items():
            setattr(rows, name, model.array(column.astype(np.int32), wp.int32))
        kinds = {"link": precision.vector(4), "V": precision.scalar, "inverse": precision.mat33}
        for name, kind in kinds.items():
            setattr(rows, name, model.array(host[name].astype(precision.numpy), kind))
        for name in ("D", "B"):
            setattr(rows, name, wp.zeros_like(rows.inverse))
        return rows

    def attach(self, model: Model, state: State) -> None:
        self.inputs = [self.params, model.box, self.rows, state.position]
        self.velocity = None if self.conservative else state.velocity
        self.variant = model.precision, model.periodic

    def apply(self, state: State, neighbors: Neighbors, dt: float) -> None:
        if len(self.members):
            self._deform()
            self._launch(kernels.force_kernel(*self.variant, self.Params), state.force)

    def _deform(self) -> None:
        damped = not self.conservative
        kernel = kernels.deform_kernel(*self.variant, damped, self.Params)
        self._launch(kernel, self.velocity)

    def _launch(self, kernel: wp.Kernel, *arrays: wp.array | None) -> None:
        launch(kernel, len(self.members), [*self.inputs, *arrays], self.model.device)

    def measure(self, state: State, energy: wp.array, virial: wp.array) -> None:
        self._measure(energy, virial, tensor=False)

    def measure_stress(self, state: State, energy: wp.array, stress: wp.array) -> bool:
        self._measure(energy, stress, tensor=True)
        return True

    def _measure(self, energy: wp.array, virial: wp.array, tensor: bool) -> None:
        if len(self.members):
            self._deform()
            kernel = kernels.measure_kernel(*self.variant, self.Params, tensor)
            self._launch(kernel, energy, virial)

    def complaint(self) -> str:
        """That places are too coarse, or that masses do not fit the rest density."""
        for peer, members, share in zip(self.peers, self.of_world, self.shares, strict=True):
            given, h = peer.parameters["rest_density"], peer.parameters["smoothing_length"]
            if coarse := self.model.unresolved(self.name, "smoothing_length", h, members):
                return coarse
            if given is not None and not SPARSE < share < DENSE:
                return (
                    f"{self.name}: rest_density must be that of the particles' masses at their "
                    f"spacing [mass/length^d], got {given:.4g}, with which they fill {share:.3g} "
                    f"of space; give about {given * share:.4g}."
                )
        return ""

    def fault(self, world: int) -> str:
        """Which particle's neighbourhood is turned inside out."""
        first = sum(map(len, self.of_world[:world]))
        mine = slice(first, first + len(self.of_world[world]))
        F = np.eye(3) + self.rows.D.numpy()[mine].astype(np.float64)
        inside_out = ~(np.linalg.det(F) > 0.0)
        if not inside_out.any():
            return ""
        particle = int(self.members[mine][inside_out.argmax()] - self.model.offsets[world])
        return (
            f"{self.name}: the neighbourhood of particle {particle} is turned inside out; use more "
            "substeps, a higher youngs_modulus or softer blows"
        )


def _joined(rest: list[Rest]) -> dict[str, np.ndarray]:
    """The links of all worlds, with rows counted through."""
    row = np.cumsum([0, *(len(each.volume) for each in rest)])
    entry = np.cumsum([0, *(len(each.c) for each in rest)])
    begin = [each.begin[:-1] + first for each, first in zip(rest, entry[:-1], strict=True)]
    other = [each.other + first for each, first in zip(rest, row[:-1], strict=True)]
    return {
        "begin": np.concatenate([*begin, entry[-1:]]),
        "other": np.concatenate(other),
        "link": np.concatenate([np.column_stack([each.X, each.c]) for each in rest]),
        "V": np.concatenate([each.volume for each in rest]),
        "inverse": np.concatenate([each.inverse for each in rest]),
    }
