"""Simulation: what is not finite is named, and bad input refused."""

import re

import numpy as np
import pytest
import warp as wp

import particlesim as ps
from cases.simulation import drifting

# Errors -----------------------------------------------------------------------------------------


@ps.law
def blow_up(position: wp.vec3, time: float, when: float):
    push = wp.vec3(0.0, 0.0, 0.0)
    if time > when and position[0] > 5.0:
        push = wp.vec3(1.0, 0.0, 0.0) / (time - time)
    return push


@pytest.mark.parametrize("execution", ["graph", "threads"])
@pytest.mark.parametrize("method", ["symplectic_euler", "velocity_verlet"])
def test_what_is_not_finite_is_named_and_taken_back(method, execution, precision, device):
    scene = drifting()
    scene.add_interaction(ps.ParticleForce(blow_up, when=0.25))
    settings = ps.Settings(dt=0.1, execution=execution, precision=precision, integrator=method)
    sim = ps.Simulation(scene, settings, device=device)
    sim.run(2)
    good = sim.position, sim.velocity
    for _ in range(2):  # and again, from the same good frame
        with pytest.raises(ps.SimulationError) as caught:
            sim.step()
        assert re.search(
            r"Simulation: .* must stay finite, got x = .*(inf|nan).* of particle 2 in world 0 "
            r"between t = 0.2 and 0.3; use more substeps",
            str(caught.value).replace("\n", " "),
        )
        np.testing.assert_array_equal(sim.position, good[0])
        np.testing.assert_array_equal(sim.velocity, good[1])
        assert sim.time == pytest.approx(0.2)
    sim.position = np.zeros((3, 3))
    sim.step()
    np.testing.assert_allclose(sim.position[:, 0], 0.1, rtol=1e-5)


def test_large_but_finite_is_finite(device):
    # Squares of these overflow float32, the numbers themselves do not.
    scene = ps.Scene()
    scene.add_particles([(1e25, 0, 0)], velocity=(0, 1e30, 0))
    sim = ps.Simulation(scene, ps.Settings(dt=1e-3), device=device)
    sim.step()
    assert sim.position[0, 1] == pytest.approx(1e27, rel=1e-6)


@pytest.mark.parametrize("device", ["cuda:7", "nonsense", "CPU", 5, ""])
def test_a_device_that_is_not_there(device, refused, capfd):
    wp.init()
    capfd.readouterr()
    with refused("Simulation: device must be one of cpu"):
        ps.Simulation(drifting(), device=device)
    assert capfd.readouterr() == ("", "")


@pytest.mark.skipif(wp.is_cuda_available(), reason="there is CUDA")
def test_cuda_where_there_is_none(refused):
    with refused("device must be one of cpu, got 'cuda'"):
        ps.Simulation(drifting(), device="cuda")
    assert ps.Simulation(drifting()).device.is_cpu


def test_a_device_as_such():
    assert ps.Simulation(drifting(), device=wp.get_device("cpu")).device.is_cpu


@pytest.mark.parametrize("scene", [None, 3, "dam_break", [None], (s for s in [])])
def test_what_is_no_scene(scene, refused):
    with refused("Simulation: scene must be a Scene or a list", kind=TypeError):
        ps.Simulation(scene)


def test_other_bad_input(refused):
    scene = drifting()
    with refused("scene must hold at least one Scene"):
        ps.Simulation([])
    with refused("settings must be a Settings", kind=TypeError):
        ps.Simulation(scene, {"dt": 0.1})
    for worlds in (0, -1, 1.5, "two"):
        with refused("worlds must be a whole number of at least 1"):
            ps.Simulation(scene, worlds=worlds)
    with refused("worlds must be left out with a list"):
        ps.Simulation([scene], worlds=2)
    sim = ps.Simulation(scene, device="cpu")
    for frames in (-1, 1.5, None):
        with refused("Simulation.run: frames"):
            sim.run(frames)
    with refused("Simulation.world: index must be from 0 to 0"):
        sim.world(1)
    for worlds in ([1], 1):
        with refused("Simulation.reset: worlds must be from 0 to 0, got 1"):
            sim.reset(worlds)
    for worlds in ([-1], ["a"], 0.5):
        with refused("Simulation.reset: worlds must be a whole number"):
            sim.reset(worlds)
