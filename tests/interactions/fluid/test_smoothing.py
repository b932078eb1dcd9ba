"""Smoothing functions: normalisation, derivatives, ends, and those of one's own."""

import functools

import numpy as np
import pytest
import warp as wp

import particlesim as ps
from particlesim.interactions.fluid.smoothing import SMOOTHING
from particlesim.interactions.fluid.smoothing.wendland import wendland_c2, wendland_c2_slope
from particlesim.kernels.precision import PRECISIONS, function_from_source

ALL = {**SMOOTHING, "mueller_viscosity": ps.MuellerViscosity()}
FUNCTIONS = [
    (name, dimension) for name, function in ALL.items() for dimension in function.dimensions
]
EPSILON = {"float32": 2.0**-24, "float64": 2.0**-53}
STEP = 1e-5  # of central differences, which err by STEP^2 / 6 of the third derivative
# Gauss's rule of 16 nodes on each of [0, 1], [1, 2] and [2, 3], between which lie the knots. It is
# exact to degree 31; of exp(-q^2) the 32nd derivative over 32! leaves 1e-20.
NODES, SHARES = np.polynomial.legendre.leggauss(16)
PLACES = {
    "nodes": np.concatenate([k + (NODES + 1) / 2 for k in range(3)]),
    "center": np.array([0.0, 1e-30]),
    "beyond": np.array([3.0, 3.1, 1e6]),
    "inside": np.linspace(0.0523, 3.2, 400),  # no knot within a STEP
}
PLACES |= {"above": PLACES["inside"] + STEP, "below": PLACES["inside"] - STEP}
AT = np.cumsum([0, *map(len, PLACES.values())])
LAWS = {
    (*key, what): getattr(ALL[key[0]].in_dimension(key[1]), what)
    for key in FUNCTIONS
    for what in ("weight", "slope", "curvature")
}


@functools.cache
def tabulated(precision):
    """All laws at all places, (laws, places), by one kernel."""
    kinds = PRECISIONS[precision]
    real = kinds.scalar
    different = list(dict.fromkeys(LAWS.values()))
    lines = [f"    y[{k}, i] = law_{k}(x[i])\n" for k in range(len(different))]
    names = {f"law_{k}": each.function(kinds) for k, each in enumerate(different)}
    names |= {"X": wp.array(dtype=real), "Y": wp.array2d(dtype=real)}
    every = function_from_source(f"def every(x: X, i: int, y: Y):\n{''.join(lines)}", names)

    @wp.kernel(module="unique", enable_backward=False)
    def run(x: wp.array(dtype=real), y_out: wp.array2d(dtype=real)):
        every(x, wp.tid(), y_out)

    x = wp.array(np.concatenate(list(PLACES.values())), dtype=real, device="cpu")
    y = wp.zeros((len(different), len(x)), dtype=real, device="cpu")
    wp.launch(run, len(x), [x, y], device="cpu")
    rows = y.numpy().astype(np.float64)
    return {key: rows[different.index(each)] for key, each in LAWS.items()}


def at(place, name, dimension, what, precision="float64"):
    k = list(PLACES).index(place)
    return tabulated(precision)[name, dimension, what][AT[k] : AT[k + 1]]


def shell(q, dimension):
    return {1: 2.0, 2: 2 * np.pi * q, 3: 4 * np.pi * q**2}[dimension]


@pytest.mark.parametrize("name, dimension", FUNCTIONS)
def test_integrates_to_one(name, dimension, precision):
    w = at("nodes", name, dimension, "weight", precision)
    sigma = ALL[name].in_dimension(dimension).sigma
    share = np.tile(SHARES, 3) / 2 * shell(PLACES["nodes"], dimension)
    assert sigma * (w * share).sum() == pytest.approx(1, rel={"float64": 1e-13, "float32": 1e-6}[
        precision
    ])  # fmt: skip


@pytest.mark.parametrize("name, dimension", FUNCTIONS)
def test_slope_and_curvature_are_derivatives_of_the_weight(name, dimension):
    get = functools.partial(at, name=name, dimension=dimension)
    q, above, below = (PLACES[each] for each in ("inside", "above", "below"))
    center = ALL[name].in_dimension(dimension).center
    curvature = get("inside", what="curvature")
    third = np.gradient(curvature, q)
    weights = get("above", what="weight"), get("below", what="weight")
    slopes = get("above", what="slope") * above, get("below", what="slope") * below
    for found, (high, low), bent in [
        (get("inside", what="slope") * q, weights, third),
        (curvature, slopes, np.gradient(third, q)),
    ]:
        # The difference errs by STEP^2 / 6 of the second derivative of what is derived, which the
        # grid shows to a factor of two or so, and rounds by some operations, on terms that are 7
        # times as large as the function at most, over the STEP.
        size = np.abs(high) + np.abs(low) + (center if np.isfinite(center) else 1.0)
        bound = STEP**2 / 2 * np.abs(bent) + 10 * 7 * EPSILON["float64"] * size / STEP
        inner = slice(2, -2)  # at its ends the grid shows less
        assert np.all((np.abs(found - (high - low) / (2 * STEP)) < bound)[inner])


@pytest.mark.parametrize("name, dimension", FUNCTIONS)
def test_ends_at_its_support_and_is_finite_at_zero(name, dimension):
    q, own = PLACES["inside"], ALL[name].in_dimension(dimension)
    for what in ("weight", "slope", "curvature"):
        assert np.all(at("beyond", name, dimension, what) == 0)
        assert np.all(at("inside", name, dimension, what)[q > own.support] == 0)
    assert np.all(at("inside", name, dimension, "slope")[q < own.support - 0.01] < 0)
    if name != "mueller_viscosity":
        assert at("center", name, dimension, "weight") == pytest.approx(own.center, rel=1e-15)
        assert np.isfinite(at("center", name, dimension, "slope")).all()


@pytest.mark.parametrize("name, dimension", FUNCTIONS)
def test_float32_is_as_exact_as_it_can_be(name, dimension):
    q = PLACES["inside"]
    for what in ("weight", "slope", "curvature"):
        exact = at("inside", name, dimension, what)
        error = np.abs(at("inside", name, dimension, what, "float32") - exact)
        # q rounded at a slope of the law, and some ten operations on terms that are seven times as
        # large as the law at most; the curvature's of C6 on a line 12 (its polynomial is 358 at 1,
        # where (1 - u)^5 is 0).
        change = np.abs(np.gradient(exact, q)) * q
        assert np.all(error < EPSILON["float32"] * (change + 10 * 12 * np.abs(exact).max()))


def test_public_values_in_every_dimension():
    """W, its derivative and its laplacian, against differences in space of W itself."""
    function, h, e = ps.WendlandC2(), 0.7, 1e-4
    x = np.array([0.31, 0.42, 0.25])
    for d in (1, 2, 3):
        near = np.concatenate(
            [x[:d] + np.zeros((1, d)), x[:d] + e * np.eye(d), x[:d] - e * np.eye(d)]
        )
        w = function.value(np.linalg.norm(near, axis=1), h, d)
        r = np.linalg.norm(x[:d])
        gradient = (w[1 : d + 1] - w[d + 1 :]) / (2 * e)
        laplacian = (w[1:].sum() - 2 * d * w[0]) / e**2
        # Central differences err by e^2 / 6 and d e^2 / 12 of derivatives that go up by some 5 / h
        # each; the second rounds by 4 eps / e^2.
        scale = w[0] * (5 / h) ** 2
        assert function.derivative(r, h, d) * x[:d] / r == pytest.approx(
            gradient, abs=e**2 * scale * 5 / h
        )
        assert function.laplacian(r, h, d) == pytest.approx(
            laplacian, abs=e**2 * scale * (5 / h) ** 2 + 8 * EPSILON["float64"] * w[0] / e**2
        )
    q = np.linspace(0, 2.5, 7)
    expected = np.maximum(1 - q / 2, 0) ** 4 * (1 + 2 * q) * 21 / 16 / np.pi / h**3
    assert function.value(q * h, h) == pytest.approx(expected, rel=1e-14, abs=1e-16)


# One's own ------------------------------------------------------------------------------------


class Own(ps.SmoothingFunction):
    """Wendland's C2 in space by its weight alone."""

    weight = wendland_c2


class OwnSlope(Own):
    slope = wendland_c2_slope


def test_own_function_equals_the_ready_one():
    ready = ps.WendlandC2().in_dimension(3)
    r = np.linspace(0.01, 1.9, 50)
    for own in (Own(), OwnSlope()):
        found = own.in_dimension(3)
        # Gauss's rule is exact for a polynomial whose knot is at the edge of a panel.
        assert found.sigma == pytest.approx(ready.sigma, rel=1e-13)
        assert found.center == 1.0 and found.support == 2.0
    assert Own().derivative(r) == pytest.approx(ps.WendlandC2().derivative(r), abs=1e-14)
    exact = ps.WendlandC2().laplacian(r)
    assert OwnSlope().laplacian(r) == pytest.approx(exact, abs=1e-13)
    # Differences of a step of 1e-3 err by 1e-6 / 6 of a fourth derivative of 60 sigma = 25.
    assert Own().laplacian(r) == pytest.approx(exact, abs=2e-5)


def test_fluid_of_an_own_function(cloud, fluid, prepared):
    """A derived slope in the loops: density and force equal those of the ready function."""
    x, v, m = cloud(60)
    found = []
    for smoothing in (Own(), "wendland_c2"):
        sim = prepared(fluid(x, v, m, smoothing=smoothing))
        found.append([sim.get(name) for name in ("density", "force")])
    for ours, theirs in zip(*found, strict=True):
        assert ours == pytest.approx(theirs, abs=1e-12 * np.abs(theirs).max())


@ps.law
def pole(q: float):
    return wp.max(1.0 - 0.5 * q, 0.0) / q


@ps.law
def never(q: float):
    return wp.exp(-0.1 * q)


@ps.law
def negative(q: float):
    return wp.min(0.5 * q - 1.0, 0.0)


@pytest.mark.parametrize(
    "weight, slope, message",
    [
        (pole, None, "Bad: weight must be finite from 0 to the support, got .*inf"),
        (never, None, "Bad: weight must end at the support, q = 2, got 0.8"),
        (negative, None, "Bad: weight must have a positive integral, got -"),
        (wendland_c2, wendland_c2, r"Bad: slope must be w'\(q\) / q, got .*; leave it out"),
    ],
)
def test_bad_functions(weight, slope, message, refused):
    kind = type("Bad", (ps.SmoothingFunction,), {"weight": weight, "slope": slope})
    with refused(message):
        kind().in_dimension(3)


def test_what_no_fluid_can_be_made_of(refused):
    given = {"smoothing_length": 0.1, "equation_of_state": ps.Polytrope(1.0)}
    with refused("SPH: smoothing must be finite at r = 0.*got 'MuellerViscosity'; give WendlandC2"):
        ps.SPH(**given, smoothing=ps.MuellerViscosity())
    with pytest.raises(TypeError, match="SPH: smoothing must be a SmoothingFunction, got 2"):
        ps.SPH(**given, smoothing=2)
    with refused(r"MuellerViscosity: dimension must be one of \(2, 3\), got 1"):
        ps.MuellerViscosity().value(0.5, dimension=1)
    with refused("Spiky: h must be above 0"):
        ps.Spiky().value(0.5, h=0.0)
    with pytest.raises(TypeError, match="SmoothingFunction: laws must have a weight, got none"):
        ps.SmoothingFunction().value(0.5)


@pytest.mark.slow
@pytest.mark.parametrize(
    "name, ratio, error",
    [
        ("cubic_spline", 1.2, 0.0008), ("cubic_spline", 1.3, -0.0027), ("quintic_spline", 1.0, 0),
        ("wendland_c2", 1.3, 0.0095), ("wendland_c2", 1.6, 0.0027), ("wendland_c2", 2.0, 0.0005),
        ("gaussian", 1.0, 0.0002), ("spiky", 1.3, 0.0808), ("spiky", 2.0, 0.0148),
    ],
)  # fmt: skip
def test_density_of_a_cubic_lattice_is_as_told(name, ratio, error):
    cells = np.arange(-6, 7)
    r = np.linalg.norm(np.stack(np.meshgrid(cells, cells, cells), axis=-1), axis=-1)
    assert SMOOTHING[name].value(r, ratio).sum() - 1 == pytest.approx(error, abs=6e-5)
