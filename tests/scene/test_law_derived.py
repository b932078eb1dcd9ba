"""Laws that are derived: loops, and Warp's extremes with derivatives that vectorise."""

import numpy as np
import pytest
import warp as wp

import particlesim as ps
from particlesim.kernels.precision import PRECISIONS

COUNT = 3  # named by a law below


@ps.law
def rounds(r: float, n: int):
    result = float(1.0)
    for _ in range(n):
        result = result * r
    return result


@ps.law
def many_rounds(r: float):
    result = float(1.0)
    for _ in range(17):
        result = result * r
    return result


@ps.law
def until(r: float):
    result = r
    while result < 1.0:
        result = result * 2.0
    return result


@ps.law
def calls_until(r: float):
    return until(r) * 2.0


@ps.law
def few_rounds(r: float):
    result = float(1.0)
    for _ in range(1, 4):
        for _k in range(COUNT):
            result = result * r
    return result


@pytest.mark.parametrize(
    ("law", "given"), [(rounds, {"n": 2}), (many_rounds, {}), (until, {}), (calls_until, {})]
)
def test_loops_that_warp_derives_wrongly_are_refused(law, given, refused):
    # Warp's adjoint of a loop that it does not write out forgets what the loop overwrites.
    with refused("must loop at most 16 rounds known in advance"):
        ps.PairPotential(law, cutoff=1.0, **given)
    ps.PairForce(law, cutoff=1.0, **given)


def test_loops_that_are_written_out_are_derived(device):
    scene = ps.Scene()
    scene.add_particles([(0, 0, 0), (0, 0.9, 0)])
    scene.add_interaction(ps.PairPotential(few_rounds, cutoff=2.0))
    sim = ps.Simulation(scene, ps.Settings(precision="float64"), device=device)
    sim.forces(0.0)
    assert sim.get("force")[0, 1] == pytest.approx(9 * 0.9**8, rel=1e-14)  # towards less r^9


# Extremes -------------------------------------------------------------------------------------


@ps.law
def extremes(a: float, b: float):
    return 2.0 * wp.max(a, b) + 3.0 * wp.min(b, a) * b + wp.clamp(a, -1.0, b)


@ps.law
def other_extremes(v: wp.vec3, n: int):
    return wp.max(v) + wp.length(wp.min(v, 2.0 * v)) + float(wp.max(n, 2))


def evaluated(a, b, precision):
    """Values and derivatives of ``extremes``, and what Warp's own functions make of the same."""
    kinds = PRECISIONS[precision]
    real, vec3, made = kinds.scalar, kinds.vec3, extremes.function(kinds)

    @wp.func
    def own(a: real, b: real):
        return real(2.0) * wp.max(a, b) + real(3.0) * wp.min(b, a) * b + wp.clamp(a, real(-1.0), b)

    @wp.kernel(module="unique", enable_backward=False)
    def evaluate(
        a: wp.array(dtype=real), b: wp.array(dtype=real),
        made_out: wp.array(dtype=vec3), own_out: wp.array(dtype=vec3),
    ):  # fmt: skip
        i = wp.tid()
        by_a, by_b = wp.grad(made)(a[i], b[i])
        made_out[i] = vec3(made(a[i], b[i]), by_a, by_b)
        own_a, own_b = wp.grad(own)(a[i], b[i])
        own_out[i] = vec3(own(a[i], b[i]), own_a, own_b)

    inputs = [wp.array(each, dtype=real, device="cpu") for each in (a, b)]
    outputs = [wp.zeros(len(a), dtype=vec3, device="cpu") for _ in range(2)]
    wp.launch(evaluate, len(a), [*inputs, *outputs], device="cpu")
    return [each.numpy() for each in outputs]


def test_extremes_are_those_of_warp(precision):
    """Values and derivatives, also at ties and of a NaN with a number."""
    special = [-2.0, -1.0, -0.0, 0.0, 0.5, 2.0, np.inf, -np.inf, np.nan]
    pairs = np.array([(a, b) for a in special for b in special if a == a or b == b])
    made, own = evaluated(*pairs.T, precision)
    assert np.array_equal(made, own, equal_nan=True)


def test_derivatives_of_extremes():
    """Against central differences, which are exact up to rounding where all is linear."""
    a, b = np.random.default_rng(0).uniform(-3, 3, (2, 50))
    h = 1e-6
    _, by_a, by_b = evaluated(a, b, "float64")[0].T
    values = [evaluated(a + da, b + db, "float64")[0][:, 0]
              for da, db in ((h, 0), (-h, 0), (0, h), (0, -h))]  # fmt: skip
    # Values of up to 40 rounded, over 2 h; b min(a, b) has a third derivative of 0.
    assert np.allclose(by_a, (values[0] - values[1]) / (2 * h), atol=1e-8)
    assert np.allclose(by_b, (values[2] - values[3]) / (2 * h), atol=1e-8)


def test_extremes_of_vectors_and_whole_numbers(precision):
    """Are Warp's own."""
    x = np.array([[1.0, -2.0, 0.5], [-1.0, -3.0, -2.0]])

    @ps.law
    def along(position: wp.vec3, n: int):
        return position * other_extremes(position, n)

    scene = ps.Scene()
    scene.add_particles(x)
    scene.add_interaction(ps.ParticleForce(along, n=5))
    sim = ps.Simulation(scene, ps.Settings(precision=precision), device="cpu")
    sim.forces(0.0)
    size = x.max(axis=1) + np.linalg.norm(np.minimum(x, 2 * x), axis=1) + 5
    assert np.allclose(sim.get("force"), x * size[:, None], rtol=1e-6)
