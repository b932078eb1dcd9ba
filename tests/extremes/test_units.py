"""The same scene in other units: right, or refused by name; never silent, endless or infinite."""

import functools
import re
import warnings

import numpy as np
import pytest
import warp as wp

import particlesim as ps
from cases.scales import PARTS, PLAIN, UNITS, law_of_powers, motion

# Of the way that particles go: motion of single precision differs from that of double by some last
# bits of the positions, 1e-7 of their distances, which a few hundred substeps add up and contacts
# take over the way of a substep (see cases.scales).
CLOSE = {"float32": 1e-5, "float64": 1e-11}
# What says by which part and quantity a scene leaves single precision, and what to do.
REFUSED = r"\w[\w.]*: [\w/^]+ must .*float32.*, got .*; choose (other|another) unit.*float64.*\."


@functools.cache
def truth(name):
    return motion(PARTS[name], PLAIN, "float64")


BETWEEN = {"electron", "colloid", "star"}  # neither the smallest nor the largest


@pytest.mark.parametrize("precision", CLOSE)
@pytest.mark.parametrize(
    "units",
    [pytest.param(k, marks=[pytest.mark.slow] * (k in BETWEEN)) for k in UNITS],
)
@pytest.mark.parametrize("name", PARTS)
def test_a_scene_in_other_units(name, units, precision):
    part, unit = PARTS[name], UNITS[units]
    if part is law_of_powers and unit.of(14, 1, -2) == 0.0:
        pytest.skip("c12 is 0 in Python: there is no such scene")
    x_true, e_true = truth(name)
    way = np.sqrt(((x_true - x_true[0]) ** 2).sum(axis=2).mean())
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            x, e = motion(part, unit, precision)
    except ValueError as error:
        assert precision == "float32", error
        assert re.fullmatch(REFUSED, str(error), re.DOTALL), error
        return
    assert np.sqrt(((x - x_true) ** 2).sum(axis=2).mean()) < CLOSE[precision] * way
    # Kinetic and potential energy may cancel: their sum is off by some last bits of either.
    assert np.abs(e - e_true).max() < 10 * CLOSE[precision] * np.abs(e_true).max()


def test_energies_beyond_single_precision(simulate):
    # Two suns an astronomical unit apart: U = -G m^2 / r = -1.8e39 J. The force is 1.2e28 N.
    G, m, r, v = 6.6743e-11, 2e30, 1.5e11, 2e4
    scene = ps.Scene()
    scene.add_particles([(0, 0, 0), (r, 0, 0)], velocity=[(0, -v, 0), (0, v, 0)], mass=m)
    scene.add_interaction(ps.Gravity(G=G))
    scene.add_interaction(ps.Springs([(0, 1)], stiffness=1e18, rest_length=0.0))
    sim = simulate(scene, 1, dt=1.0)
    found = sim.diagnostics()
    expected = -G * m * m / r + 0.5 * 1e18 * r * r
    np.testing.assert_allclose(found.potential, expected, rtol=1e-6)
    np.testing.assert_allclose(found.kinetic, m * v * v, rtol=1e-4)


@pytest.mark.parametrize(
    ("part", "told"),
    [
        (lambda: ps.Springs([(0, 1)], 100.0, 1.0), "Springs: rest_length"),
        (lambda: ps.Distance([(0, 1)], 1.2), "Distance: distances"),
        (lambda: ps.Distance([(0, 1)], compliance=1.0).as_force(), "Distance as a force: dist"),
        (lambda: ps.Contact(), "Contact: diameter"),
        (lambda: ps.PlaneBoundary((0, -1, 0), (0, 1, 0)), "PlaneBoundary: diameter"),
        (lambda: ps.LennardJones(cutoff=2.5), "LennardJones: cutoff or spacing"),
        (lambda: ps.Gravity(softening=0.5), "Gravity: spacing"),
        (
            lambda: ps.SPH(smoothing_length=3.0, equation_of_state=ps.Polytrope(1.0, 1.0)),
            "SPH: smoothing_length",
        ),
    ],
    ids=["springs", "rod", "penalty", "contact", "plane", "cutoff", "spacing", "fluid"],
)
def test_places_too_far_from_the_origin_are_told(part, told):
    """Near 1e6 numbers of single precision are 1/16 apart; near 1e5 an eighth of that."""

    def run(far, **knobs):
        scene = ps.Scene()
        scene.add_particles([(far, 0, 0), (far + 1.2, 0, 0)], radius=0.1)
        made = part()
        (scene.add_constraint if hasattr(made, "project") else scene.add_interaction)(made)
        ps.Simulation(scene, ps.Settings(dt=1e-4, **knobs), device="cpu").run(1)

    way_out = r"choose an origin nearer by, or Settings\(precision='float64'\)"
    with pytest.warns(ps.StabilityWarning, match=f"{told}.* must be far above what .*; {way_out}"):
        run(1e6)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        run(1e6, precision="float64")
        run(1e4)


@pytest.mark.parametrize("dt", [1e-300, 1e-50, 1e300])
def test_steps_that_leave_the_precision(dt, refused):
    scene = ps.Scene()
    scene.add_particles([(0, 0, 0)], velocity=(1, 0, 0))
    with refused("Settings: dt must make a substep of 1.2e-38 to 3.4e\\+38"):
        ps.Simulation(scene, ps.Settings(dt=dt), device="cpu")
    knobs = ps.Settings(dt=dt, precision="float64")
    if dt == 1e-50:
        sim = ps.Simulation(scene, knobs, device="cpu")
        sim.run(10)
        assert sim.position[0, 0] == pytest.approx(10 * dt)
    else:
        with refused("Settings: dt must make a substep of 6.0e-154 to 3.4e\\+153"):
            ps.Simulation(scene, knobs, device="cpu")


def test_values_that_are_set_are_held_against_the_precision(refused):
    scene = ps.Scene()
    scene.add_particles([(0, 0, 0)], velocity=(1, 0, 0))
    sim = ps.Simulation(scene, device="cpu")
    for name, value, told in (
        ("mass", 0.0, "mass must be above 0"),
        ("mass", 1e50, "mass must be within float32"),
        ("mass", 1e-42, "mass must be within float32"),  # whose inverse is infinite
        ("velocity", (1e39, 0, 0), "velocity must be within float32"),
    ):
        with refused(f"Simulation.set: {told}"):
            sim.set(name, value)
    assert sim.get("mass") == 1.0


@ps.law
def bend(a: wp.vec3, b: wp.vec3, c: wp.vec3):
    """The cosine of an angle, whose gradient falls with the lengths."""
    return wp.dot(wp.normalize(a - b), wp.normalize(c - b))


@pytest.mark.parametrize("scale", [1e-40, 1e-15, 1.0, 1e20, 1e40])
def test_constraints_that_are_no_lengths_act_in_any_unit(scale, simulate):
    # A corner of 60 degrees opens to a right angle, whatever the unit of length.
    scene = ps.Scene()
    scene.add_particles(scale * np.array([(1, 0, 0), (0, 0, 0), (0.5, np.sqrt(0.75), 0)]))
    scene.add_constraint(ps.Constraint(bend, [(0, 1, 2)]))
    sim = simulate(scene, 1, precision="float64")
    a, b, c = sim.position / scale
    assert abs(np.dot(a - b, c - b)) < 1e-3
