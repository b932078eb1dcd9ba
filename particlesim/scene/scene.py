"""Scene and Group: what there is, in NumPy on the host, without device work."""

from __future__ import annotations

import difflib
from collections.abc import Sequence
from typing import Any

import numpy as np

from .. import validate
from .bounds import corners, periodic_box
from .constraint_base import ConstraintBase
from .group import PALETTE, Color, Group
from .part import Interaction
from .thermostat import Barostat, Thermostat

# Names of the engine's own per-particle arrays, which attributes of a scene cannot take.
RESERVED = frozenset(
    "position velocity mass inverse_mass radius force world density pressure correction image "
    "previous_position position_error velocity_error smoothing_length time dt x".split()
)
# What else add_particles takes, and how alike a name may be to these.
ARGUMENTS = ("velocity", "mass", "radius", "group", "pinned", "color", "triangles", "position")
CLOSE = 0.72


class Scene:
    """Particles, interactions, constraints and thermostats, as a description.

    Args:
        up_axis: ``"y"`` or ``"z"``: what pictures and USD show as up; nothing else minds it. With
            ``"x"`` both are refused, for USD, which pictures rest on too, knows Y and Z only.
        meters_per_unit: Length of one unit [m], for exports.
        periodic: ``(lower, upper)`` corners of a periodic box; None on an axis leaves it open:
            ``((0, None, 0), (1, None, 1))``. None: open everywhere.
        bounds: ``(lower, upper)`` corners of what no particle may leave, each side open where it is
            None; the watchdog reports who does (see Settings). They hold nothing: boundaries do.

    Example:
        >>> scene = Scene()
        >>> ball = scene.add_particles([(0, 1, 0)], mass=2.0, radius=0.1, group="ball")
        >>> len(ball), scene.particle_count
        (1, 1)
    """

    def __init__(
        self,
        up_axis: str = "y",
        meters_per_unit: float = 1.0,
        periodic: tuple[Sequence[float | None], Sequence[float | None]] | None = None,
        bounds: tuple[Sequence[float | None], Sequence[float | None]] | None = None,
    ):
        self.up_axis = validate.choice("Scene", "up_axis", up_axis, ("x", "y", "z"))
        self.meters_per_unit = validate.number(
            "Scene", "meters_per_unit", meters_per_unit, above=0.0, unit="m"
        )
        self.periodic = periodic_box(periodic)
        self.bounds = corners(bounds)
        self.groups: list[Group] = []
        self.interactions: list[Interaction] = []
        self.constraints: list[ConstraintBase] = []
        self.thermostats: list[Thermostat] = []
        self._columns: dict[str, list[np.ndarray]] = {}
        self._widths: dict[str, int | None] = {}
        self.particle_count = 0
        self.changes = 0  # how often something was added

    def add_particles(
        self,
        position: Any,
        *,
        velocity: Any = 0.0,
        mass: Any = 1.0,
        radius: Any = 0.0,
        group: str | None = None,
        pinned: Any = False,
        color: Sequence[float] | None = None,
        triangles: Any = None,
        **attributes: Any,
    ) -> Group:
        """Add particles and return them as a :class:`Group`.

        Args:
            position: (n, 3) [length].
            velocity: (3,) for all, or (n, 3) [length/time].
            mass: One for all, or (n,); above zero [mass].
            radius: One for all, or (n,); used by contacts, boundaries and pictures [length].
            group: Name, unique in the scene; None: ``group_<k>``.
            pinned: One for all, or (n,) bool; a pinned particle has infinite mass for forces
                and constraints and keeps its velocity.
            color: (r, g, b) in 0..1 for pictures and exports, in linear light as USD has it: a
                share s of sRGB, as most colour pickers show it, is about s^2.2.
            triangles: (t, 3) int into these particles, counterclockwise from outside: exports draw
                the group as this surface.
            **attributes: Further per-particle values that laws may name (``charge=...``): one
                number for all, (n,) or (n, 3). Groups added without one have zeros.

        Raises:
            ValueError: Wrong shapes, values that are not finite, masses or radii out of range,
                a name used twice, triangles of other particles.
        """
        owner = "Scene.add_particles"
        x = validate.rows(owner, "position", position, None, 3)
        count = len(x)
        name = f"group_{len(self.groups)}" if group is None else str(group)
        if any(name == other.name for other in self.groups):
            raise validate.fail(owner, "group", "be a new name", name, "choose another")
        surface = None if triangles is None else validate.triangles(owner, triangles, count)
        columns: dict[str, np.ndarray] = {
            "position": x,
            "velocity": validate.rows(owner, "velocity", velocity, count, 3),
            "mass": validate.rows(owner, "mass", mass, count, None),
            "radius": validate.rows(owner, "radius", radius, count, None),
            "pinned": validate.rows(owner, "pinned", pinned, count, None),
        }
        m, r, held = columns["mass"], columns["radius"], columns["pinned"]
        _bounded(owner, "mass", m, m > 0, "above 0", "use pinned=True to hold")
        _bounded(owner, "radius", r, r >= 0, "at least 0", "give a size")
        _bounded(owner, "pinned", held, (held == 0) | (held == 1), "True or False", "choose one")
        for key, value in attributes.items():
            columns[key] = self._attribute(owner, key, value, count)
        chosen = self._color(owner, color)
        self._append(columns, count)
        stop = self.particle_count
        result = Group(self, name, stop - count, stop, chosen, surface)
        self.groups.append(result)
        return result

    def _append(self, columns: dict[str, np.ndarray], count: int) -> None:
        """Rows for so many more particles; what some have and others not is zero for these."""
        for key, column in columns.items():
            if key not in self._columns:
                width = column.shape[1] if column.ndim == 2 else None
                self._widths[key] = width
                shape = (self.particle_count,) if width is None else (self.particle_count, width)
                self._columns[key] = [np.zeros(shape)]
        for key, parts in self._columns.items():
            width = self._widths[key]
            shape = (count,) if width is None else (count, width)
            parts.append(columns.get(key, np.zeros(shape)))
        self.particle_count += count
        self.changes += 1

    def _color(self, owner: str, color: Any) -> Color:
        """The colour given, or the next of the palette."""
        if color is None:
            return PALETTE[len(self.groups) % len(PALETTE)]
        rgb = validate.vector(owner, "color", color)
        _bounded(owner, "color", rgb, (rgb >= 0) & (rgb <= 1), "from 0 to 1", "scale it")
        red, green, blue = rgb
        return (float(red), float(green), float(blue))

    def _attribute(self, owner: str, key: str, value: Any, count: int) -> np.ndarray:
        if key in RESERVED:
            raise validate.fail(owner, "attribute", "have a name of its own", key, "rename it")
        if key not in self._widths:
            self._suspect(owner, key)
            return validate.rows(owner, key, value, count, 3 if np.ndim(value) == 2 else None)
        width = self._widths[key]
        if (np.ndim(value) == 2) > (width == 3):
            raise validate.fail(owner, key, "be numbers as before", np.shape(value), "use one kind")
        return validate.rows(owner, key, value, count, width)

    def _suspect(self, owner: str, key: str) -> None:
        """Refuse an attribute whose name is nearly that of an argument, as vel and masses are."""
        for name in ARGUMENTS:
            short = len(key) > 1 and name.startswith(key)
            if short or difflib.get_close_matches(key, [name], cutoff=CLOSE):
                raise validate.fail(
                    owner, "attribute", f"have a name unlike its own argument {name}", key,
                    f"write {name}=..., or choose another name",
                )  # fmt: skip

    def add_interaction(self, interaction: Interaction) -> Interaction:
        """Add a force; it acts at the start of every substep, in the order of adding."""
        if not isinstance(interaction, Interaction):
            raise TypeError(
                f"Scene.add_interaction: interaction must be an Interaction, got {interaction!r}; "
                "wrap a law in PairForce, PairPotential or ParticleForce."
            )
        self._add(self.interactions, "interaction", interaction)
        return interaction

    def add_constraint(self, constraint: ConstraintBase) -> ConstraintBase:
        """Add a constraint; it projects positions after integration, in the order of adding."""
        if not isinstance(constraint, ConstraintBase):
            raise TypeError(
                f"Scene.add_constraint: constraint must be a constraint, got {constraint!r}; "
                "wrap a law in Constraint."
            )
        self._add(self.constraints, "constraint", constraint)
        return constraint

    def add_thermostat(self, thermostat: Thermostat) -> Thermostat:
        """Add a heat bath; it acts in the middle of every drift, in the order of adding."""
        if not isinstance(thermostat, Thermostat) or isinstance(thermostat, Barostat):
            raise TypeError(
                f"Scene.add_thermostat: thermostat must be a Thermostat, got {thermostat!r}; "
                "make a Langevin or a VelocityRescaling."
            )
        self._add(self.thermostats, "thermostat", thermostat)
        return thermostat

    def add_barostat(self, barostat: Barostat) -> Barostat:
        """Add what holds the pressure; it acts as a thermostat does, and after those before it."""
        if not isinstance(barostat, Barostat):
            raise TypeError(
                f"Scene.add_barostat: barostat must be a Barostat, got {barostat!r}; "
                "make a CellRescaling."
            )
        owner = "Scene.add_barostat"
        if self.periodic is None or not all(self.periodic[2]):
            raise validate.fail(
                owner, "scene", "be periodic along all axes", self.periodic,
                "give Scene(periodic=...)",
            )  # fmt: skip
        if any(isinstance(each, Barostat) for each in self.thermostats):
            raise validate.fail(
                owner, "barostat", "be the only one of the scene", barostat, "leave one out"
            )
        self._add(self.thermostats, "barostat", barostat)
        return barostat

    def _add(self, parts: list[Any], kind: str, part: Any) -> None:
        if any(part is each for each in parts):
            raise validate.fail(
                f"Scene.add_{kind}", kind, "be new to the scene", f"the same {part.name} again",
                "make another, or change its strength",
            )  # fmt: skip
        parts.append(part)
        self.changes += 1

    def column(self, name: str) -> np.ndarray:
        """A per-particle array of the description, (n,) or (n, 3) float64."""
        if name not in self._columns:
            width = 3 if name in ("position", "velocity") else None
            return np.zeros((self.particle_count,) if width is None else (0, 3))
        parts = self._columns[name]
        if len(parts) > 1:
            parts[:] = [np.concatenate(parts)]
        return parts[0]

    @property
    def attributes(self) -> dict[str, int | None]:
        """Names of the per-particle values, with None for numbers and 3 for vectors."""
        return dict(self._widths)

    @property
    def position(self) -> np.ndarray:
        """Start positions, (n, 3)."""
        return self.column("position")

    @property
    def velocity(self) -> np.ndarray:
        """Start velocities, (n, 3)."""
        return self.column("velocity")

    @property
    def mass(self) -> np.ndarray:
        """Masses, (n,)."""
        return self.column("mass")

    @property
    def radius(self) -> np.ndarray:
        """Radii, (n,)."""
        return self.column("radius")

    @property
    def pinned(self) -> np.ndarray:
        """Which particles are pinned, (n,) bool."""
        return self.column("pinned") > 0

    def __getitem__(self, name: str) -> Group:
        """The group of that name."""
        for group in self.groups:
            if group.name == name:
                return group
        names = [group.name for group in self.groups]
        raise KeyError(f"Scene: group must be one of {names}, got {name!r}; choose one of these.")


def _bounded(
    owner: str, name: str, values: np.ndarray, good: np.ndarray, condition: str, remedy: str
) -> None:
    if not good.all():
        at = int(np.argmin(good))
        raise validate.fail(owner, f"{name}[{at}]", f"be {condition}", float(values[at]), remedy)
