"""The complementary error function that laws call, against the C library's."""

import math

import numpy as np
import pytest
import warp as wp

import particlesim as ps
from particlesim.kernels.error_function import complement
from particlesim.kernels.precision import PRECISIONS


@pytest.mark.parametrize("name", PRECISIONS)
def test_it_is_the_complementary_error_function(name, device):
    """x^2 is rounded by half a unit of it, which is an error of exp(-x^2) in parts; four more of
    the polynomial, of the exponential, of their product and of the library.
    """
    real = PRECISIONS[name].scalar

    @wp.kernel(module="unique")
    def values(x: wp.array(dtype=real), y: wp.array(dtype=real)):
        y[wp.tid()] = complement(x[wp.tid()])

    x = np.append(np.linspace(-3.0, 9.0, 4001), [0.0, 40.0, -40.0, np.inf, -np.inf]).astype(name)
    given = wp.array(x, dtype=real, device=device)
    found = wp.zeros_like(given)
    wp.launch(values, len(x), [given, found], device=device)
    y, expected = found.numpy().astype(float), np.array([math.erfc(each) for each in x])
    known = np.isfinite(x) & (np.abs(x) < 40)
    allowed = (4.0 + 0.5 * x[known].astype(float) ** 2) * np.finfo(name).eps
    assert (np.abs(y - expected)[known] < allowed * expected[known]).all()
    assert y[-4:].tolist() == [0.0, 2.0, 0.0, 2.0]


@pytest.mark.parametrize("precision", ["float64", pytest.param("float32", marks=pytest.mark.slow)])
def test_laws_call_it_and_derive_it(precision):
    """F = -du/dr of what near pairs of an Ewald sum have, to some ten roundings."""

    @ps.law
    def near(r: float):
        return wp.erfc(0.7 * r) / r

    scene = ps.Scene()
    scene.add_particles([(0, 0, 0), (1.3, 0, 0)])
    scene.add_interaction(ps.PairPotential(near, cutoff=3.0))
    sim = ps.Simulation(scene, ps.Settings(precision=precision))
    r = float(sim.position[1, 0] - sim.position[0, 0])
    F = (math.erfc(0.7 * r) / r + 1.4 / math.sqrt(math.pi) * math.exp(-((0.7 * r) ** 2))) / r
    assert sim.get("force")[1, 0] == pytest.approx(F, rel=20 * float(np.finfo(precision).eps))
