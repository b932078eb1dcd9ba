"""Elastic solids in water: their particles count in its density, and have next to no pressure."""

import numpy as np
import pytest

import particlesim as ps

Y, NU, DENSITY, GRAVITY = 3.5e6, 0.3, 1000.0, 9.81


def wet(bar, water, spacing, depth, held=False, speed=0.0, density=DENSITY, **options):
    """A scene of a solid and of water that is as deep, in the plane."""
    scene, cell = ps.Scene(), spacing**2
    solid = scene.add_particles(bar, mass=density * cell, pinned=held, group="solid")
    v = (speed, 0, 0)
    water = scene.add_particles(water, mass=DENSITY * cell, velocity=v, group="water")
    given = {"rest_density": density, "smoothing_length": 1.3 * spacing, "dimension": 2}
    scene.add_interaction(ps.ElasticSolid(solid, Y, NU, **given))
    sound = 10 * np.sqrt(GRAVITY * depth)
    states = [ps.Tait(sound), ps.Tait(1e-3 * sound)]  # a millionth of the water's pressure
    given |= {"rest_density": [DENSITY, density], "smoothing_length": 1.6 * spacing}
    scene.add_interaction(ps.SPH([water, solid], equation_of_state=states, **given, **options))
    return scene, solid, water


def plane(lower, upper, spacing):
    """Points of a square lattice."""
    return ps.sample.box((*lower, 0), (*upper, spacing), spacing=spacing)


@pytest.mark.slow
def test_a_blow_of_water_keeps_momentum_and_energy():
    spacing = 0.05
    bar = plane((0, 0), (0.3, 1), spacing)
    jet = plane((-0.5 - 2 * spacing, 0.2), (-2 * spacing, 0.6), spacing)
    scene, solid, _ = wet(bar, jet, spacing, 0.5, speed=1.0)
    knobs = {"integrator": "velocity_verlet", "precision": "float64"}
    sim = ps.Simulation(scene, ps.Settings(dt=0.02, substeps=100, **knobs), device="cpu")
    before = sim.diagnostics()
    sim.run(40)
    after = sim.diagnostics()
    # 200 particles, 4000 substeps of sums that round by eps of the momentum of the jet, 200.
    rounding = 4000 * np.finfo(np.float64).eps * 200
    assert np.abs(after.momentum - before.momentum).max() < rounding
    assert np.abs(after.angular_momentum - before.angular_momentum).max() < rounding
    # Velocity Verlet's, (omega dt)^2 / 8 = 0.003 of what swings fastest, and a part of all does.
    assert after.energy[0] == pytest.approx(before.energy[0], rel=1e-3)
    assert sim.velocity[solid.slice, 0].mean() > 0.1


@pytest.mark.slow
def test_a_plate_bends_under_water():
    across, thick, length, depth = 8, 0.2, 1.0, 0.5
    spacing = thick / across
    plate = plane((-4 * spacing, -thick), (length + 4 * spacing, 0), spacing)
    held = (plate[:, 0] < 0) | (plate[:, 0] > length)
    scene, solid, water = wet(
        plate, plane((0, 0), (length, depth), spacing), spacing, depth, held=held
    )
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
    moved = sim.position - scene.position
    assert bent[0] < -moved[middle, 1].mean() < bent[1]
    # The water has sunk with the plate, by half a spacing where it meets it, and by p / 2 rho c^2.
    x = sim.position[water.slice, 1]
    assert depth - 0.5 * spacing - x.max() < bent[1] + 0.5 * spacing + 0.005 * depth
    assert x.min() > -bent[1]  # and nothing has gone through


@pytest.mark.slow
def test_a_block_floats():
    spacing, depth, width, height, part = 0.02, 0.4, 0.4, 0.2, 0.5
    lower = np.array([0.5 - 0.5 * width, depth - part * height])
    block = plane(lower, lower + np.array([width, height]), spacing)
    water = plane((0, 0), (1, depth), spacing)
    water = water[(np.abs(water[:, 0] - 0.5) > 0.5 * width) | (water[:, 1] < lower[1])]
    scene, solid, water = wet(
        block, water, spacing, 2 * depth, density=part * DENSITY,
        viscosity=ps.ArtificialViscosity(0.2),
    )  # fmt: skip
    scene.add_interaction(ps.UniformGravity((0, -GRAVITY, 0)))
    scene.add_constraint(ps.BoxBoundary((0, 0, -np.inf), (1, np.inf, np.inf), group=water))
    sim = ps.Simulation(scene, ps.Settings(dt=0.02, substeps="auto"), device="cpu")
    draught = []
    for _ in range(150):
        sim.step()
        x = sim.position[water.slice]
        columns = np.floor(x[:, 0] / spacing).astype(int)
        beside = np.abs(x[:, 0] - 0.5) > 0.5 * width + 0.1
        tops = [x[columns == each, 1].max() for each in np.unique(columns[beside])]
        bottom = sim.position[solid.slice, 1].mean() - 0.5 * height
        draught.append(np.mean(tops) + 0.5 * spacing - bottom)
    # Archimedes, to half a spacing, which nobody knows better of a surface of particles.
    assert np.mean(draught[-30:]) == pytest.approx(part * height, abs=0.5 * spacing)
    tilt = np.polyfit(block[:, 0], sim.position[solid.slice, 1], 1)[0]
    assert abs(tilt) < 0.01
