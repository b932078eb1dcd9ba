"""The laws of SPH alone: equations of state, viscosity."""

import numpy as np
import pytest
import warp as wp

import particlesim as ps
from particlesim.kernels.precision import PRECISIONS, function_from_source

EPSILON = {"float32": 2.0**-24, "float64": 2.0**-53}
STEP = 1e-5  # of central differences, which err by STEP^2 / 6 of the third derivative


def evaluate(law, *columns, precision="float64"):
    """The law on each row of the columns, by a kernel."""
    kinds = PRECISIONS[precision]
    real, width = kinds.scalar, len(columns)
    arguments = ", ".join(f"x[i, {k}]" for k in range(width))
    each = function_from_source(
        f"def each(x: Rows, i: int):\n    return law({arguments})\n",
        {"law": law.function(kinds), "Rows": wp.array2d(dtype=real)},
    )

    @wp.kernel(module="unique", enable_backward=False)
    def run(x: wp.array2d(dtype=real), result_out: wp.array(dtype=real)):
        result_out[wp.tid()] = each(x, wp.tid())

    rows = np.column_stack(np.broadcast_arrays(*columns))
    x = wp.array(rows, dtype=real, ndim=2, device="cpu")
    result = wp.zeros(len(x), dtype=real, device="cpu")
    wp.launch(run, len(x), [x, result], device="cpu")
    return result.numpy().astype(np.float64)


def derivative(f, x):
    """Central difference."""
    return (f(x + STEP) - f(x - STEP)) / (2 * STEP)


EQUATIONS = [
    ps.Tait(10.0, negative_pressure=True),
    ps.Tait(3.0, exponent=1.4, negative_pressure=True),
    ps.Tait(10.0),
    ps.Polytrope(2.0, 1.0),
    ps.Polytrope(0.5, 1.5),
]


def of_state(equation, name, density):
    """Pressure, energy or sound speed at these densities, for a rest density of 1."""
    given = {"density": density, "rest_density": 1.0, **equation.parameters}
    if name == "sound_speed":
        given["pressure"] = of_state(equation, "pressure", density)
    law = equation.laws[name]
    return evaluate(law, *(given[argument] for argument in law.parameters))


@pytest.mark.parametrize("equation", EQUATIONS)
def test_pressure_derives_from_the_energy_and_sound_from_the_pressure(equation):
    density = np.linspace(1.1, 1.6, 20)
    # The third derivative of s^7 is 210 / s^3 of it: errors of STEP^2 * 210 / 6 < 4e-9.
    slope = derivative(lambda rho: of_state(equation, "energy", rho), density)
    assert np.allclose(of_state(equation, "pressure", density), density**2 * slope, rtol=1e-8)
    stiffness = derivative(lambda rho: of_state(equation, "pressure", rho), density)
    assert np.allclose(of_state(equation, "sound_speed", density) ** 2, stiffness, rtol=1e-8)


@pytest.mark.parametrize("equation", EQUATIONS[:3])
def test_tait_rests_at_the_rest_density(equation):
    one = np.ones(1)
    scale = equation.parameters["sound_speed"] ** 2
    for name in ("pressure", "energy"):
        assert abs(of_state(equation, name, one)[0]) < 4 * scale * EPSILON["float64"]
    speed = of_state(equation, "sound_speed", one)[0]
    assert speed == pytest.approx(equation.parameters["sound_speed"], rel=1e-15)


def test_tait_has_tension_only_when_asked():
    thin = np.array([0.3, 0.5, 0.99])
    assert np.all(of_state(ps.Tait(10.0), "pressure", thin) == 0)
    assert np.all(np.abs(of_state(ps.Tait(10.0), "energy", thin)) < 1e-13)
    assert np.allclose(of_state(ps.Tait(10.0), "sound_speed", thin), 10.0)
    stretched = of_state(ps.Tait(10.0, negative_pressure=True), "pressure", thin)
    assert np.allclose(stretched, 100 / 7 * (thin**7 - 1))


def test_artificial_viscosity():
    """Monaghan 1992, eq. 4.2, by hand."""
    approach = np.array([-0.3, -0.01, 0.0, 0.2])
    r2, h, rho, c, alpha, beta = 0.04, 0.1, 2.0, 5.0, 0.7, 1.4
    mu = h * np.minimum(approach, 0) / (r2 + 0.01 * h * h)
    expected = (-alpha * c * mu + beta * mu**2) / rho
    law = ps.ArtificialViscosity(alpha, beta).term
    given = {
        "approach": approach, "distance_squared": r2, "smoothing_length": h, "density": rho,
        "sound_speed": c, "alpha": alpha, "beta": beta,
    }  # fmt: skip
    result = evaluate(law, *(given[name] for name in law.parameters))
    assert np.allclose(result, expected, rtol=1e-14)
    assert np.all(result[:2] > 0) and np.all(result[2:] == 0)


@pytest.mark.parametrize(
    "make, message",
    [
        (lambda: ps.Tait(0.0), r"Tait: sound_speed must be above 0 \[length/time\], got 0"),
        (lambda: ps.Tait(np.nan), "Tait: sound_speed must be finite"),
        (lambda: ps.Tait(10.0, exponent=1.0), "Tait: exponent must be above 1, got 1"),
        (lambda: ps.Polytrope(-1.0), "Polytrope: constant must be above 0, got -1"),
        (lambda: ps.Polytrope(1.0, index=0.0), "Polytrope: index must be above 0"),
        (lambda: ps.ArtificialViscosity(-0.1), "ArtificialViscosity: alpha must be at least 0"),
        (lambda: ps.ArtificialViscosity(0.1, np.inf), "ArtificialViscosity: beta must be finite"),
    ],
)
def test_bad_parameters(make, message):
    with pytest.raises(ValueError, match=message):
        make()
