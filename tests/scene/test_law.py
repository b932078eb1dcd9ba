"""Laws: one source in both precisions, and what may stand in it."""

import math

import numpy as np
import pytest
import warp as wp

import particlesim as ps

RATE = 0.1  # named by laws below
COUNT = 3
AXIS = wp.vec3(0.0, 0.5, 2.0)  # exact in float32, as a Warp vector of float32 must be


class Constants:
    scale = 0.3

    class Deeper:
        count = 2
        factor = 0.1


@ps.law
def literals(position: wp.vec3):
    return 0.1 * position / 0.7 + wp.vec3(0.1, -0.2, 1e-3)


@ps.law
def helper(s: float):
    return s / 3.0


@ps.law
def helpers(position: wp.vec3):
    return position * helper(helper(position[0]))


@wp.func
def warp_helper(s: float, factor: float):
    return s * factor * 0.1


@ps.law
def warp_helpers(position: wp.vec3):
    return position * warp_helper(position[0], 0.3) + position * warp_helper(position[1], 0.7)


@ps.law
def names(position: wp.vec3):
    result = RATE * position + math.pi * AXIS + wp.pi * Constants.scale * position
    for _ in range(Constants.Deeper.count):
        result = result * Constants.Deeper.factor
    return result


def _closure(a, n):
    weight = 0.1

    @ps.law
    def closure(position: wp.vec3):
        result = a * position
        for _ in range(n):
            result = result * weight
        return result

    return closure


closure = _closure(0.7, 2)


@ps.law
def defaults(position: wp.vec3, stiffness: float = 0.1, n: int = 2):
    result = -stiffness * position
    for _ in range(n):
        result = result * 0.9
    return result


@ps.law
def branches(position: wp.vec3):
    result = wp.vec3(0.0, 0.0, 0.0)
    if position[0] > 0.1:
        result = position * 0.1
    elif position[1] > 0.1:
        result = wp.vec3(position[2], 0.3, 0.0)
    weight = 1.1 if position[2] > 0.0 else -0.3
    for k in range(COUNT):
        result[k] = result[k] + wp.sqrt(wp.abs(position[k])) * weight
    return result


@ps.law
def position_of(v: wp.vec3):
    return v + wp.vec3(1.0)


@ps.law
def untyped(velocity: wp.vec3, factor):
    return velocity * factor


def reference(name, x):
    """The same laws in NumPy, over rows."""
    first, second, third = (x[:, k : k + 1] for k in range(3))
    if name == "literals":
        return 0.1 * x / 0.7 + [0.1, -0.2, 1e-3]
    if name == "helpers":
        return x * first / 9.0
    if name == "warp_helpers":
        return x * first * 0.3 * 0.1 + x * second * 0.7 * 0.1
    if name == "names":
        return 0.01 * (0.1 * x + math.pi * np.array([0, 0.5, 2.0]) + math.pi * 0.3 * x)
    if name == "closure":
        return 0.7 * x * 0.1**2
    if name == "defaults":
        return -0.1 * x * 0.9**2
    if name == "branches":
        other = np.where(second > 0.1, np.hstack([third, 0 * third + 0.3, 0 * third]), 0.0)
        weight = np.where(third > 0, 1.1, -0.3)
        return np.where(first > 0.1, 0.1 * x, other) + np.sqrt(np.abs(x)) * weight
    if name == "untyped":
        return 0.1 * x
    raise AssertionError(name)


def forces(law, x, precision, device="cpu", **parameters):
    """The law as a force on particles at ``x`` that move at ``x``."""
    scene = ps.Scene()
    scene.add_particles(x, velocity=x)
    scene.add_interaction(ps.ParticleForce(law, **parameters))
    sim = ps.Simulation(scene, ps.Settings(precision=precision), device=device)
    sim.forces(0.0)
    return sim.get("force")


# The laws take under 30 roundings of numbers up to 10; float64 must show no trace of float32.
TOLERANCE = {
    "float32": 30 * 10 * np.finfo(np.float32).eps,
    "float64": 30 * 10 * np.finfo(float).eps,
}


@pytest.mark.parametrize(
    ("law", "parameters"),
    [
        (literals, {}), (helpers, {}), (warp_helpers, {}), (names, {}), (closure, {}),
        (defaults, {}), (branches, {}), (untyped, {"factor": 0.1}),
    ],
    ids=lambda value: getattr(value, "name", ""),
)  # fmt: skip
def test_one_source_for_both_precisions(law, parameters, precision, device):
    x = np.random.default_rng(0).uniform(-1, 1, (50, 3))
    if precision == "float32":
        x = x.astype(np.float32).astype(float)
    force = forces(law, x, precision, device, **parameters)
    assert force.dtype == precision
    expected = reference(law.name, x)
    np.testing.assert_allclose(force, expected, rtol=0, atol=TOLERANCE[precision])


def test_conversions_inside_a_law(precision, device):
    @ps.law
    def mixed(velocity: wp.vec3):
        total = float(0.0)
        for k in range(3):
            total += float(k) * 0.1 * wp.max(velocity[k], 0.2)
        return wp.normalize(position_of(velocity)) * total

    x = np.array([[0.5, -0.25, 0.75], [0.25, 0.5, 0.125]])
    total = 0.1 * np.maximum(x[:, 1], 0.2) + 0.2 * np.maximum(x[:, 2], 0.2)
    expected = (x + 1) / np.linalg.norm(x + 1, axis=1)[:, None] * total[:, None]
    np.testing.assert_allclose(
        forces(mixed, x, precision, device), expected, rtol=0, atol=TOLERANCE[precision]
    )


def test_whole_parameters_stay_whole(precision, device):
    x = np.array([[0.5, 0.25, 0.75]])
    force = forces(defaults, x, precision, device, n=5, stiffness=2.0)
    np.testing.assert_allclose(force, -2 * x * 0.9**5, rtol=0, atol=TOLERANCE[precision])


def test_whole_parameters_refuse_fractions(refused):
    with refused("ParticleForce: n must be a whole number"):
        ps.ParticleForce(defaults, n=2.5)


def test_warp_functions_and_plain_functions_are_laws(precision, device):
    @wp.func
    def from_warp(velocity: wp.vec3):
        return velocity * 0.1

    def plain(velocity: wp.vec3):
        return velocity * 0.1

    x = np.array([[0.5, 0.25, 0.75]])
    for func in (from_warp, plain):
        np.testing.assert_allclose(
            forces(func, x, precision, device), 0.1 * x, rtol=0, atol=TOLERANCE[precision]
        )


def test_a_law_stays_callable():
    assert helper(3.0) == 1.0
    assert helper.name == "helper"
    assert list(defaults.parameters) == ["position", "stiffness", "n"]
    assert ps.law(helper) is helper


def test_laws_of_the_same_code_are_the_same():
    # A scene's build() makes its laws anew in every call; they are of one kind for a batch.
    assert _closure(0.7, 2).key == _closure(0.7, 2).key
    assert _closure(0.7, 2).key != _closure(0.8, 2).key
    assert _closure(0.7, 2).key != helper.key


def test_what_a_name_stands_for_may_change(monkeypatch, device):
    x = np.array([[0.5, 0.25, 0.75]])
    before = forces(names, x, "float64", device)
    monkeypatch.setattr(Constants.Deeper, "factor", 0.2)
    after = forces(ps.law(names.func), x, "float64", device)
    np.testing.assert_allclose(after, 4 * before, rtol=1e-14)


def test_what_is_no_law(refused):
    with refused("law: func must be a function, got 5", kind=TypeError):
        ps.law(5)
    with refused("law: func must be a def", kind=TypeError):
        ps.law(lambda r: r)
    with refused("law: func must be a def", kind=TypeError):
        scope = {}
        exec("def typed_in(r): return r", scope)
        ps.law(scope["typed_in"])

    def many(r, *rest):
        return r

    with refused("parameter 'rest' of many must be positional", kind=TypeError):
        ps.law(many)
