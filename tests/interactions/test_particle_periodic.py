"""Energies of forces on each particle in periodic boxes: what has been climbed, box after box."""

import numpy as np
import pytest
import warp as wp

import particlesim as ps

FAR = np.array([(25.0, 4.0, -3.0), (-7.5, -31.0, 60.0), (5.0, 5.0, 5.0)])


@ps.law
def tilt(position: wp.vec3, mass: float, slope: wp.vec3):
    """Linear in the position, as a user would write it."""
    return mass * wp.dot(slope, position) + 3.0


@ps.law
def wave(position: wp.vec3, number: float):
    """The same on opposite sides of a box of length 10."""
    return wp.sin(number * 0.6283185307179586 * position[0])


@ps.law
def trap(position: wp.vec3, center: wp.vec3):
    d = position - center
    return 0.5 * wp.dot(d, d)


def _simulation(force, precision, device, periodic=((0, None, -5), (10, None, 3)), **particles):
    scene = ps.Scene(periodic=periodic)
    scene.add_particles(**{"position": FAR, "mass": [1.0, 2.0, 4.0], **particles})
    scene.add_interaction(force)
    settings = ps.Settings(dt=0.5, precision=precision, integrator="velocity_verlet")
    return ps.Simulation(scene, settings, device=device)


@pytest.mark.parametrize(
    "force",
    [
        ps.ConstantForce((1, -2, 3)),
        ps.ConstantForce((1, -2, 3), [0, 2]),
        ps.UniformGravity((0.5, 2, -0.25)),
        ps.ParticleForce(potential=tilt, slope=(1, 2, 3)),
    ],
)
def test_uniform_fields_have_the_energy_that_they_have_without_a_box(force, precision, device):
    boxed, free = (
        _simulation(force, precision, device, **box).diagnostics().potential[0]
        for box in ({}, {"periodic": None})
    )
    assert boxed == pytest.approx(free, abs=1e3 * float(np.finfo(precision).eps))


@pytest.mark.parametrize("force", [ps.ConstantForce((1, 0, 0)), ps.UniformGravity((-4, 1, 2))])
def test_the_energy_of_who_falls_through_boxes_is_kept(force, precision, device):
    box = ((0, 0, 0), (10, 8, 6))
    sim = _simulation(force, precision, device, box, velocity=(1, -2, 0.5))
    start = sim.diagnostics().energy[0]
    most = abs(start)
    for _ in range(12):
        sim.step()
        now = sim.diagnostics()
        most = max(most, now.kinetic[0])
        # Verlet is exact in a uniform field; what is left is rounding of terms as large as these.
        assert now.energy[0] == pytest.approx(start, abs=16 * float(np.finfo(precision).eps) * most)
    assert np.abs(sim.get("image")).max() > 5


def test_a_potential_that_repeats_has_no_rise(precision, device):
    inside = np.array([(5.0, 4, -3), (2.5, -31, 60 - 64), (5, 5, 5 - 8)])
    far, near = (
        _simulation(ps.ParticleForce(potential=wave, number=3.0), precision, device, position=x)
        .diagnostics()
        .potential[0]
        for x in (FAR, inside)
    )
    assert far == pytest.approx(near, abs=1e3 * float(np.finfo(precision).eps))


@pytest.mark.parametrize("center", [5.0, 3.0])
def test_a_trap_in_every_box_rises_by_what_its_sides_differ(center, device):
    """From box to box by U(10) - U(0); by nothing where the trap is in the middle."""
    force = ps.ParticleForce(potential=trap, center=(center, 0, 0))
    scene_x = [(25.0, 0, 0), (-7.5, 0, 0), (5, 0, 0)]
    sim = _simulation(force, "float64", device, position=scene_x)
    rise = 0.5 * ((10 - center) ** 2 - center**2)
    inside = 0.5 * ((np.array([5, 2.5, 5]) - center) ** 2).sum()
    assert sim.diagnostics().potential[0] == pytest.approx(inside + (2 - 1) * rise, rel=1e-14)
    sim.forces(1.0)
    np.testing.assert_allclose(sim.get("force")[:, 0], center - np.array([5, 2.5, 5]))


def test_work_in_a_trap_of_every_box_is_its_energy(device):
    """Rolling through the boxes: energy is kept as well as steps across the kinks allow."""
    force = ps.ParticleForce(potential=trap, center=(3.0, 0, 0))
    scene = ps.Scene(periodic=((0, None, None), (10, None, None)))
    scene.add_particles([(3, 0, 0)], velocity=(20, 0, 0))
    scene.add_interaction(force)
    settings = ps.Settings(dt=0.1, substeps=200, precision="float64", integrator="velocity_verlet")
    sim = ps.Simulation(scene, settings, device=device)
    for _ in range(20):
        sim.step()
        # A step across a side has a force wrong by at most 10 for 5e-4: 0.1 at a speed of 20, once
        # a box, of either sign; four boxes.
        assert sim.diagnostics().energy[0] == pytest.approx(200.0, abs=0.4)
    assert sim.get("image")[0, 0] > 2


def test_each_world_climbs_its_own_box(device):
    def world(side):
        scene = ps.Scene(periodic=((0, 0, 0), (side,) * 3))
        scene.add_particles(FAR)
        scene.add_interaction(ps.ConstantForce((1, 2, 3)))
        return scene

    sim = ps.Simulation([world(4.0), world(7.0)], ps.Settings(precision="float64"), device=device)
    expected = -(FAR @ (1, 2, 3)).sum()
    np.testing.assert_allclose(sim.diagnostics().potential, [expected, expected], rtol=1e-14)
