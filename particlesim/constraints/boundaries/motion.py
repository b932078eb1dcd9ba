"""Motions of boundaries, given as laws of time or as poses at times."""

from __future__ import annotations

import itertools
from dataclasses import dataclass
from typing import Any

import numpy as np
import warp as wp

from ... import validate
from ...interactions.laws.arguments import Arguments
from ...kernels.constraints.boundaries import paths as kernels
from ...kernels.constraints.rigid_motion import pose_type
from ...kernels.parameters import by_name, parameter_types, structures
from ...kernels.precision import FLOAT64, Precision, structure
from ...scene.law import Law
from ...scene.law import law as make_law

OWN = frozenset({"pivot", "instant"})


class Motion:
    """Base of what says where a boundary is at each time: a way and a turn about its pivot."""

    @property
    def name(self) -> str:
        """What errors call it."""
        return type(self).__name__

    def kind(self) -> tuple[Any, ...]:
        """What must agree in all worlds."""
        return (type(self),)

    def path(self, params: Any) -> wp.Function:
        """As a Warp function (see kernels.constraints.boundaries.paths)."""
        raise validate.undefined(self, "path(self, params)")

    def values(self, device: Any) -> dict[str, Any]:
        """What the path takes, by name."""
        raise validate.undefined(self, "values(self, device)")

    def struct(self, device: Any, pivot: np.ndarray, instant: float) -> tuple[Any, dict[str, Any]]:
        """The struct of its parameters, and these."""
        values = {**self.values(device), "pivot": pivot, "instant": instant}
        return structure(f"{self.name}Parameters", parameter_types(values, FLOAT64)), values

    def kernel(self, precision: Precision, params: Any) -> wp.Kernel:
        """The kernel that places what moves so."""
        return kernels.path_kernel(self.path(params), precision, params)

    def at(self, time: float, pivot: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """The way, (3,), the turn about the pivot, (3, 3), and the velocity of that, (3,)."""
        Params, values = self.struct("cpu", pivot, 2.0**-20 * max(1.0, abs(time)))
        motion = structures(Params, by_name([values]), "cpu")
        clock = wp.array([time], dtype=wp.float64, device="cpu")
        pose = wp.zeros(1, dtype=pose_type(FLOAT64), device="cpu")
        wp.launch(self.kernel(FLOAT64, Params), 1, [0, motion, clock, pose], device="cpu")
        found = pose.numpy()[0]
        return found["shift"], np.eye(3) + found["turn"], found["velocity"]


@dataclass(eq=False, init=False)
class Trajectory(Motion):
    """A motion by laws of the time since the world's start.

    The velocity of the surface is the derivative, in double precision.

    Args:
        place: ``T(t, ...)``, the way of the pivot as a ``wp.vec3`` [length]; None: it stays.
        turn: ``r(t, ...)``, the rotation about the pivot as a ``wp.vec3``, its axis times its angle
            [rad]; None: it does not turn.
        **parameters: The laws' further parameters: a number each, or (3,) where a law takes a
            ``wp.vec3``.

    Raises:
        ValueError: Neither law; one that takes no time first, or returns no vector; a parameter
            that is missing.
        TypeError: A parameter that no law has.

    Example:
        >>> @law
        ... def shaken(t: float, amplitude: wp.vec3, omega: float):
        ...     return amplitude * wp.sin(omega * t)
        >>> table = Trajectory(shaken, amplitude=(0.01, 0, 0), omega=30.0)
        >>> table.parameters["omega"]
        30.0
    """

    place: Law | None
    turn: Law | None
    parameters: dict[str, Any]

    def __init__(self, place: Any = None, turn: Any = None, **parameters: Any):
        if place is None and turn is None:
            raise validate.fail(self.name, "place", "be given, or turn", None, "give a law of time")
        self.place = None if place is None else make_law(place)
        self.turn = None if turn is None else make_law(turn)
        self.parameters, self._names = {}, []
        known = {name for law in self._laws() for name in list(law.parameters)[1:]}
        validate.known(self.name, parameters, sorted(known), "parameter")
        for law in (self.place, self.turn):
            self._names.append(() if law is None else self._taken(law, parameters))

    def _laws(self) -> list[Law]:
        return [law for law in (self.place, self.turn) if law is not None]

    def _taken(self, law: Law, given: dict[str, Any]) -> tuple[str, ...]:
        """The names of a law's further parameters, whose values are kept."""
        names = tuple(law.parameters)
        if not names or law.parameters[names[0]] is wp.vec3:
            raise validate.fail(
                self.name, f"law {law.name}", "take the time first", list(names),
                "write def law(t: float, ...)",
            )  # fmt: skip
        for name in OWN & {*names[1:]}:
            raise validate.fail(
                self.name, f"parameter {name} of {law.name}", "have a name of its own", name,
                "rename it",
            )  # fmt: skip
        law.function(FLOAT64, self.name, wp.vec3)
        own = {name: value for name, value in given.items() if name in names}
        values = Arguments(self.name, law, 1, own, ()).values
        for name, value in values.items():
            check = validate.vector if law.parameters[name] is wp.vec3 else validate.number
            check(self.name, name, value)
        self.parameters |= values
        return names[1:]

    def kind(self) -> tuple[Any, ...]:
        return (type(self), *(law.key for law in self._laws()), *self._names)

    def path(self, params: Any) -> wp.Function:
        place, turn = (
            None if law is None else law.function(FLOAT64, self.name, wp.vec3)
            for law in (self.place, self.turn)
        )  # fmt: skip
        return kernels.law_path(place, turn, tuple(self._names), params)

    def values(self, device: Any) -> dict[str, Any]:
        return dict(self.parameters)


@dataclass(eq=False)
class Keyframes(Motion):
    """A motion through given poses at given times, smoothly: as a film gives one a frame.

    In between the way is a cubic (Catmull and Rom 1974), and so is the rotation vector from the
    pose before, so that velocities have no jumps: at each time those over both neighbours hold, at
    the first and the last it rests, and before and beyond it stays.

    Args:
        times: Rising, (k,), 2 or more, since the world's start [time].
        places: The way of the pivot at each, (k, 3) [length]; None: it stays.
        turns: The rotation about the pivot at each, (k, 3): its axis times its angle [rad]; None:
            it does not turn. From one to the next it turns the shorter way, by less than pi.

    Raises:
        ValueError: Values out of range, of other shapes; times that do not rise; neither places nor
            turns.

    Example:
        >>> lift = Keyframes([0.0, 2.0], places=[(0, 0, 0), (0, 3, 0)])
        >>> BoxBoundary((0, 0, 0), (1, 1, 1), motion=lift).moves
        True
    """

    times: Any
    places: Any = None
    turns: Any = None

    def __post_init__(self) -> None:
        times = validate.grid(self.name, "times", self.times, 1)
        if not (np.diff(times) > 0).all():
            raise validate.fail(self.name, "times", "rise [time]", times, "sort them")
        if self.places is None and self.turns is None:
            raise validate.fail(self.name, "places", "be given, or turns", None, "give poses")
        count = len(times)
        nothing = np.zeros((count, 3))
        self.times = times
        self.places = nothing if self.places is None else self._column("places", self.places)
        self.turns = nothing if self.turns is None else self._column("turns", self.turns)
        length = np.diff(times)[:, None]
        self._ways = _cubics(self.places[:-1], np.diff(self.places, axis=0),
                             _speeds(times, np.diff(self.places, axis=0)), length)  # fmt: skip
        self._starts, self._vectors = self._turned(length)

    def _column(self, name: str, value: Any) -> np.ndarray:
        rows = validate.rows(self.name, name, value, None, 3)
        if len(rows) != len(self.times):
            raise validate.fail(
                self.name, name, f"have a row for each of {len(self.times)} times", len(rows),
                "give as many",
            )  # fmt: skip
        return rows

    def _turned(self, length: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """The turn that each piece starts with, and its cubics of the rotation vector from there.

        The derivative of exp(r) at r is the inverse of its right Jacobian times the angular
        velocity in the turned frame, which here is known at both ends.
        """
        turns = np.array([_rotation(r) for r in self.turns])
        steps = np.array([_vector(a.T @ b) for a, b in itertools.pairwise(turns)])
        # Angular velocities in the frame of the space, by what is turned there.
        moved = np.einsum("kij,kj->ki", turns[:-1], steps)
        speeds = _speeds(self.times, moved)
        first = np.einsum("kji,kj->ki", turns[:-1], speeds[:-1])
        last = np.einsum("kji,kj->ki", turns[1:], speeds[1:])
        last = np.stack([_against(r) @ w for r, w in zip(steps, last, strict=True)])
        cubics = _hermite(0 * steps, steps, first * length, last * length)
        return turns[:-1] - np.eye(3), cubics[:, 1:]

    def path(self, params: Any) -> wp.Function:
        return kernels.key_path(params)

    def values(self, device: Any) -> dict[str, Any]:
        if not hasattr(self, "_made"):
            self._made: dict[str, dict[str, wp.array]] = {}
        if str(device) not in self._made:
            given = {
                "times": (self.times, wp.float64), "ways": (self._ways, wp.vec3d),
                "starts": (self._starts, wp.mat33d), "turns": (self._vectors, wp.vec3d),
            }  # fmt: skip
            self._made[str(device)] = {
                name: wp.array(np.ascontiguousarray(value), dtype=dtype, device=device)
                for name, (value, dtype) in given.items()
            }
        return self._made[str(device)]


def _speeds(times: np.ndarray, steps: np.ndarray) -> np.ndarray:
    """Velocities at the times: over both neighbours; at rest at the ends."""
    found = np.zeros((len(times), steps.shape[1]))
    found[1:-1] = (steps[:-1] + steps[1:]) / (times[2:] - times[:-2])[:, None]
    return found


def _cubics(
    start: np.ndarray, step: np.ndarray, speeds: np.ndarray, length: np.ndarray
) -> np.ndarray:
    """Coefficients of each piece, (k - 1, 4, 3), in time over its length."""
    return _hermite(start, step, speeds[:-1] * length, speeds[1:] * length)


def _hermite(start: np.ndarray, step: np.ndarray, first: np.ndarray, last: np.ndarray) -> Any:
    """Cubics from values and slopes at both ends."""
    return np.stack([start, first, 3 * step - 2 * first - last, first + last - 2 * step], axis=1)


def _rotation(r: np.ndarray) -> np.ndarray:
    """The matrix of a rotation vector (Rodrigues)."""
    angle = float(np.linalg.norm(r))
    if angle == 0.0:
        return np.eye(3)
    cross = np.cross(np.eye(3), r / angle)
    return np.eye(3) + np.sin(angle) * cross + 2 * np.sin(angle / 2) ** 2 * cross @ cross


def _vector(R: np.ndarray) -> np.ndarray:
    """The rotation vector of a matrix, by the largest of the parts of its quaternion."""
    t = np.trace(R)
    squares = np.array([1 + t, *(1 + 2 * np.diag(R) - t)])
    k = int(np.argmax(squares))
    odd = np.array([R[2, 1] - R[1, 2], R[0, 2] - R[2, 0], R[1, 0] - R[0, 1]])
    if k == 0:
        q = np.array([squares[0], *odd])
    else:
        even = R[k - 1] + R[:, k - 1]
        even[k - 1] = squares[k]
        q = np.array([odd[k - 1], *even])
    q = q / np.linalg.norm(q)
    q = q if q[0] >= 0 else -q
    half = np.linalg.norm(q[1:])
    return 2 * np.arctan2(half, q[0]) * (q[1:] / half if half > 0 else q[1:])


def _against(r: np.ndarray) -> np.ndarray:
    """The inverse of the right Jacobian of exp at r."""
    angle = float(np.linalg.norm(r))
    cross = np.cross(np.eye(3), r)
    if angle < 1e-3:  # the next term is angle^4 / 30240, and the difference loses digits
        factor = 1 / 12 + angle**2 / 720
    else:
        factor = (1 - 0.5 * angle / np.tan(0.5 * angle)) / angle**2
    return np.eye(3) + 0.5 * cross + factor * cross @ cross
