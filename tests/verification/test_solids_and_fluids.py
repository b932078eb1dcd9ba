"""Elastic solids that water meets: a force between pairs, and what goes across it."""

import numpy as np
import pytest
import warp as wp

import particlesim as ps

Y, NU, DENSITY, GRAVITY = 3.5e6, 0.3, 1000.0, 9.81


@ps.law
def push(r: float, stiffness: float, reach: float):
    """Of two surfaces, nearer than a spacing."""
    overlap = wp.max(reach - r, 0.0)
    return 0.5 * stiffness * overlap * overlap


def add_water(scene, x, spacing, depth, **options):
    water = scene.add_particles(x, mass=DENSITY * spacing**2, group="water", **options)
    sound = ps.Tait(10 * np.sqrt(GRAVITY * depth))
    scene.add_interaction(
        ps.SPH(water, smoothing_length=1.6 * spacing, rest_density=DENSITY, dimension=2,
               equation_of_state=sound)
    )  # fmt: skip
    return water


def add_solid(scene, x, spacing, **options):
    solid = scene.add_particles(x, mass=DENSITY * spacing**2, group="solid", **options)
    given = {"smoothing_length": 1.3 * spacing, "rest_density": DENSITY, "dimension": 2}
    scene.add_interaction(ps.ElasticSolid(solid, Y, NU, **given))
    return solid


def add_surface(scene, spacing, depth):
    """Which a pressure of that depth dents by a hundredth of the spacing."""
    given = {"stiffness": 100 * DENSITY * GRAVITY * depth, "reach": spacing}
    scene.add_interaction(ps.PairPotential(push, groups=scene.groups, cutoff=spacing, **given))


@pytest.mark.slow
def test_a_blow_of_water_keeps_momentum_and_energy():
    spacing, scene = 0.05, ps.Scene()
    bar = ps.sample.box((0, 0, 0), (0.3, 1, spacing), spacing=spacing)
    jet = ps.sample.box((-0.5, 0.2, 0), (-spacing, 0.6, spacing), spacing=spacing)
    add_solid(scene, bar, spacing)
    add_water(scene, jet, spacing, 0.5, velocity=(1, 0, 0))
    add_surface(scene, spacing, 0.5)
    knobs = {"integrator": "velocity_verlet", "precision": "float64"}
    sim = ps.Simulation(scene, ps.Settings(dt=0.02, substeps=100, **knobs), device="cpu")
    before = sim.diagnostics()
    sim.run(40)
    after = sim.diagnostics()
    # 200 particles, 4000 substeps of sums that round by eps of the momentum of the jet, 200.
    rounding = 4000 * np.finfo(np.float64).eps * 200
    assert np.abs(after.momentum - before.momentum).max() < rounding
    assert np.abs(after.angular_momentum - before.angular_momentum).max() < rounding
    assert after.energy[0] == pytest.approx(before.energy[0], rel=1e-3)
    assert sim.velocity[scene["solid"].slice, 0].mean() > 0.1


@pytest.mark.slow
def test_a_plate_bends_under_water():
    across, thick, length, depth = 8, 0.2, 1.0, 0.5
    spacing, scene = thick / across, ps.Scene()
    plate = ps.sample.box(
        (-4 * spacing, -thick, 0), (length + 4 * spacing, 0, spacing), spacing=spacing
    )
    held = (plate[:, 0] < 0) | (plate[:, 0] > length)
    solid = add_solid(scene, plate, spacing, pinned=held)
    x = ps.sample.box((0, 0, 0), (length, depth, spacing), spacing=spacing)
    water = add_water(scene, x + np.array([0, 0.3 * spacing, 0]), spacing, depth)
    add_surface(scene, spacing, depth)
    scene.add_interaction(ps.UniformGravity((0, -GRAVITY, 0), group=water))
    scene.add_constraint(
        ps.BoxBoundary((0, -np.inf, -np.inf), (length, np.inf, np.inf), group=water)
    )
    scene.add_interaction(ps.Drag(15 * DENSITY * spacing**2))  # some e^-11 of the swing is left
    sim = ps.Simulation(scene, ps.Settings(dt=0.02, substeps="auto"), device="cpu")
    sim.run(75)
    load, modulus, shear = DENSITY * GRAVITY * depth, Y / (1 - NU**2), Y / (2 * (1 + NU))
    # Held at both ends, w L^4 / 384 E I and by shear w L^2 / 8 kappa G A; clamps that each give way
    # over half a spacing make the plate longer by one.
    longer = length + np.array([0.0, spacing])
    bent = load * longer**4 / (384 * modulus * thick**3 / 12)
    bent += load * longer**2 / (8 * 5 / 6 * shear * thick)
    middle = solid[np.abs(plate[:, 0] - 0.5 * length) < 0.6 * spacing]
    sunk = -(sim.position - scene.position)[middle, 1].mean()
    assert bent[0] < sunk < bent[1]
    assert (sim.position[water.slice, 1] > -2 * bent[1]).all()  # it is tight
