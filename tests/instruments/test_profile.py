"""Profile: what is measured launch by launch is the same run."""

from collections import Counter

import numpy as np
import pytest

import particlesim as ps
from particlesim.scenes import pile


def drops(count=600):
    """Particles that fall onto the ground and touch: forces, lists and constraints."""
    scene = ps.Scene()
    side = int(np.ceil(count ** (1 / 3)))
    scene.add_particles(ps.sample.lattice("sc", (side,) * 3, 0.201)[:count], radius=0.1)
    scene.add_interaction(ps.UniformGravity((0, -9.81, 0)))
    scene.add_constraint(ps.Contact())
    scene.add_constraint(ps.PlaneBoundary((0, -0.1, 0), (0, 1, 0)))
    return scene


@pytest.mark.parametrize("threads", [1, 2])
def test_the_bits_are_those_of_a_plain_run(liquid, device, threads):
    settings = ps.Settings(dt=0.02, substeps=4, threads=threads)
    # 1372 atoms are enough to be shared by threads.
    for scene, worlds in ((liquid(cells=7), 1), (drops(), 2)):
        plain, profiled = (
            ps.Simulation(scene, settings, device=device, worlds=worlds) for _ in range(2)
        )
        for _ in range(6):
            plain.step()
        found = profiled.profile(6)
        assert found.frames == 6 and found.substeps == 24
        for name in ("position", "velocity"):
            np.testing.assert_array_equal(profiled.get(name), plain.get(name))


def test_launches_are_those_that_explain_tells(liquid, device):
    sim = ps.Simulation(liquid(cells=5), ps.Settings(dt=0.01, substeps=3), device=device)
    found = sim.profile(5)
    always = Counter((owner, name) for owner, name, _ in sim.explain().launches)
    measured = {(each.owner, each.name): each.launches for each in found.passes}
    for key, times in always.items():
        assert measured[key] == 5 * 3 * times
    assert all(each.seconds > 0 for each in found.passes if each.launches)


def test_lists_are_counted_when_they_are_made(liquid, device):
    # Cold atoms on their lattice do not move: the list of the start serves all substeps.
    still = ps.Simulation(liquid(cells=5, temperature=0.0), ps.Settings(dt=1e-3), device=device)
    assert still.profile(3).builds == {"LennardJones": 0}
    # Drops side by side that fly by a skin a substep need another one in each.
    scene = ps.Scene()
    scene.add_particles([(0, 0, 0), (2, 0, 0)], velocity=(100.0, 0, 0))
    scene.add_interaction(ps.LennardJones(cutoff=2.5))
    flying = ps.Simulation(scene, ps.Settings(dt=0.1, substeps=5, skin=0.3), device=device)
    found = flying.profile(4)
    assert found.builds == {"LennardJones": 19}  # not before anything has moved
    assert "listed 19 times in 20 substeps" in str(found)


def test_rows_that_were_full_are_made_again_within_a_profile(device):
    # Bodies that fall together: rows get longer than they were at the start.
    x = ps.sample.uniform_sphere((0, 0, 0), 3.0, 800, seed=1)
    scene = ps.Scene()
    scene.add_particles(x, velocity=-2.0 * x)
    scene.add_interaction(ps.PairForce(push, cutoff=0.6))
    settings = ps.Settings(dt=0.1, substeps=4)
    plain, profiled = (ps.Simulation(scene, settings, device=device) for _ in range(2))
    generation = profiled.neighbors.generation
    for _ in range(4):
        plain.step()
    found = profiled.profile(4)
    assert profiled.neighbors.generation > generation and found.frames > 4
    np.testing.assert_array_equal(profiled.position, plain.position)


@ps.law
def push(r: float):
    """Hardly anything."""
    return 1e-6 * r


def test_bytes_are_those_of_the_arrays_that_a_launch_names(device):
    scene = ps.Scene()
    scene.add_particles(np.eye(3), velocity=(1, 0, 0))
    sim = ps.Simulation(scene, ps.Settings(compensated=False), device=device)
    (advance,) = [each for each in sim.profile(1).passes if each.name == "advance"]
    # Position and velocity, three vectors of three floats each, and whatever is one for all.
    assert 2 * 36 <= advance.bytes <= 2 * 36 + 64


def test_afterwards_frames_run_as_before(device):
    sim = ps.Simulation(pile.build(), pile.settings, device=device)
    found = sim.profile(2)
    assert found.in_passes <= found.in_frames <= found.seconds
    assert "clock" not in sim.explain().execution
    with pytest.raises(ZeroDivisionError), sim.profiling():
        raise ZeroDivisionError
    assert "clock" not in sim.explain().execution


def test_the_table_says_what_is_outside_of_kernels(device):
    sim = ps.Simulation(pile.build(), pile.settings, device=device)
    text = str(sim.profile(2))
    for words in ("Contact", "between launches", "outside the frames", "GB/s", "2 frames"):
        assert words in text


def test_what_cannot_be_is_refused(refused):
    scene = ps.Scene()
    scene.add_particles([(0, 0, 0)])
    with refused("frames must"):
        ps.Simulation(scene, device="cpu").profile(0)
