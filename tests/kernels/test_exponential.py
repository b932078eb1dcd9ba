"""The exponential that laws call, against NumPy's in long double precision."""

import numpy as np
import pytest
import warp as wp

import particlesim as ps
from particlesim.kernels.exponential import exponential
from particlesim.kernels.precision import PRECISIONS


@pytest.mark.parametrize(("name", "ends"), [("float32", (-90, 92)), ("float64", (-720, 715))])
def test_it_is_the_exponential(name, ends, device):
    """To less than a unit in the last place: half of one for rounding, and what is before it."""
    real = PRECISIONS[name].scalar

    @wp.kernel(module="unique")
    def values(x: wp.array(dtype=real), y: wp.array(dtype=real)):
        y[wp.tid()] = exponential(x[wp.tid()])

    rng = np.random.default_rng(0)
    x = np.concatenate([np.linspace(*ends, 20_001), rng.uniform(-1, 1, 2000)]).astype(name)
    given = wp.array(x, dtype=real, device=device)
    found = wp.zeros_like(given)
    wp.launch(values, len(x), [given, found], device=device)
    with np.errstate(over="ignore", under="ignore"):
        expected = np.exp(x.astype(np.longdouble))
    numbers = np.finfo(name)
    known = (expected > 3 * numbers.tiny) & (expected < numbers.max)
    off = np.abs(found.numpy().astype(np.longdouble) - expected) / numbers.eps
    assert (off[known] < expected[known]).all()
    assert not found.numpy()[expected < numbers.tiny].any()
    assert np.isinf(found.numpy()[expected > np.longdouble(1.0001) * numbers.max]).all()


def test_what_is_no_number(device):
    @wp.kernel(module="unique")
    def values(x: wp.array(dtype=wp.float32), y: wp.array(dtype=wp.float32)):
        y[wp.tid()] = exponential(x[wp.tid()])

    x = wp.array([0.0, np.inf, -np.inf, 1e30, -1e30, np.nan], dtype=wp.float32, device=device)
    found = wp.zeros_like(x)
    wp.launch(values, 6, [x, found], device=device)
    np.testing.assert_array_equal(found.numpy(), [1.0, np.inf, 0.0, np.inf, 0.0, np.nan])


def test_laws_call_it_and_derive_it(precision):
    """F = -du/dr of Morse's potential, to some ten roundings."""

    @ps.law
    def morse(r: float):
        e = wp.exp(-1.9 * (r - 1.1))
        return e * (e - 2.0)

    scene = ps.Scene()
    scene.add_particles([(0, 0, 0), (1.3, 0, 0)])
    scene.add_interaction(ps.PairPotential(morse, cutoff=3.0))
    sim = ps.Simulation(scene, ps.Settings(precision=precision))
    r = sim.position[1, 0] - sim.position[0, 0]
    e = np.exp(-1.9 * (float(r) - 1.1))
    F = 2 * 1.9 * e * (e - 1)
    assert sim.get("force")[1, 0] == pytest.approx(F, rel=20 * float(np.finfo(precision).eps))
