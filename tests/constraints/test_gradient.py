"""check_gradient, and laws over one to eight particles."""

import numpy as np
import pytest
import warp as wp

import particlesim as ps

# Differences of step h ~ 6e-6 of the size are wrong by h^2 C'''/6 ~ 1e-11 and by 1e-16 / h ~ 4e-11
# of C / size; a tuple of eight that is far less steep than long loses one digit or two of these.
EXACT = 1e-8
RNG = np.random.default_rng(5)


@ps.law
def web(
    a: wp.vec3, b: wp.vec3, c: wp.vec3, d: wp.vec3, e: wp.vec3, f: wp.vec3, g: wp.vec3, h: wp.vec3,
    rest: float,
):  # fmt: skip
    """The length of what eight particles span, from the first one on."""
    return wp.length(a + 2.0 * b + 3.0 * c - 4.0 * d + wp.cross(e, f) - 2.0 * g + h) - rest


@ps.law
def kinked(a: wp.vec3, b: wp.vec3):
    return wp.abs(a[0] - b[0])


def spanned(x):
    """The law in NumPy, of (m, 8, 3)."""
    a, b, c, d, e, f, g, h = np.moveaxis(x, 1, 0)
    total = a + 2 * b + 3 * c - 4 * d + np.cross(e, f) - 2 * g + h
    return np.linalg.norm(total, axis=1)


FIXED = {name: (0.3, -0.2, 0.1) for name in "bcdefgh"}


@pytest.mark.parametrize(
    "k", [pytest.param(k, marks=[pytest.mark.slow] * (k != 3)) for k in range(1, 9)]
)
def test_laws_over_one_to_eight_particles(k, device, simulate):
    """Rows of k indices: the gradient is derived, and one step brings C to its tangent's zero."""
    x = RNG.uniform(-1, 1, (6 * k, 3))
    fixed = {name: FIXED[name] for name in "abcdefgh"[k:]}
    assert ps.check_gradient(web, x.reshape(6, k, 3), rest=1.0, **fixed) < EXACT
    tuples = np.arange(6 * k).reshape(6, k)
    part = ps.Constraint(web, tuples, rest=1.0, **fixed)
    assert part.particles.shape == (6, k)
    scene = ps.Scene()
    scene.add_particles(x)
    scene.add_constraint(part)
    sim = simulate(scene, device)
    sim.project(30)
    given = np.broadcast_to([fixed[name] for name in fixed], (6, 8 - k, 3)) if fixed else ()
    at = sim.position.reshape(6, k, 3)
    whole = np.concatenate([at, given], axis=1) if fixed else at
    assert np.allclose(spanned(whole), 1.0, rtol=0, atol=1e-12)  # Newton's steps, to round-off


def test_a_constraint_is_taken_as_it_is():
    """Its indices name rows of the points; a gradient written by hand is checked like any other."""
    points = RNG.normal(size=(5, 3))
    rods = ps.Distance([(4, 1), (0, 2)], rest_length=0.3)
    assert ps.check_gradient(rods, points) < EXACT
    assert ps.check_gradient(ps.Distance(np.zeros((0, 2), int)), points) == 0.0


def test_a_kink_is_told():
    """At a kink the derivative is that of one side, or of none, and differences are neither."""
    assert ps.check_gradient(kinked, np.zeros((2, 3))) == 1.0


def test_bad_input():
    with pytest.raises(ValueError, match=r"points must hold 5 points or more, got 3; "):
        ps.check_gradient(ps.Distance([(0, 4)]), np.zeros((3, 3)))
    with pytest.raises(ValueError, match=r"points must have shape \(k, 3\) or \(m, k, 3\)"):
        ps.check_gradient(kinked, [1.0, 2.0])
    with pytest.raises(TypeError, match="parameter beside Distance"):
        ps.check_gradient(ps.Distance([(0, 1)]), np.zeros((3, 3)), rest=1.0)
    with pytest.raises(ValueError, match="points"):
        ps.check_gradient(kinked, [(0, 0, np.nan), (1, 0, 0)])
