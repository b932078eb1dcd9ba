"""Surfaces: the same again, whose they are, and what is refused."""

import logging
import sys

import numpy as np
import pytest

import particlesim as ps

RATIO = 1.3  # h over the spacing


def test_bit_for_bit_and_without_a_word(capfd, caplog, simulated, mesh_of):
    caplog.set_level(logging.DEBUG)
    x = ps.sample.random((0, 0, 0), (20, 20, 20), 8000, seed=2)
    surface = ps.Surface(simulated(x))
    capfd.readouterr()
    first = surface.mesh()
    for _ in range(4):
        assert all(np.array_equal(a, b) for a, b in zip(first, surface.mesh(), strict=True))
    # On one thread, which the library has no other way to be told of here.
    surface._options["multi_threading"] = False
    assert all(np.array_equal(a, b) for a, b in zip(first, surface.mesh(), strict=True))
    assert capfd.readouterr() == ("", "") and not caplog.records


def test_groups_and_worlds(mesh_of):
    def build(radius):
        scene = ps.Scene()
        scene.add_particles(ps.sample.sphere((20, 0, 0), 2.0, 1.0), radius=0.5, group="stone")
        water = scene.add_particles(
            ps.sample.sphere((0, 0, 0), radius, 1.0), radius=0.1, group="water"
        )
        scene.add_interaction(
            ps.SPH(water, smoothing_length=RATIO, rest_density=1.0, equation_of_state=ps.Tait(9.0))
        )
        return scene

    scenes = [build(2.0), build(3.0)]
    sim = ps.Simulation(scenes, device="cpu")
    fluid_mesh = ps.Surface(sim, world=1).mesh()
    assert fluid_mesh[0][:, 0].max() < 10  # with SPH in the scene, None means the fluid
    for group in ("water", scenes[0]["water"], scenes[1]["water"], list(scenes[1]["water"])):
        assert np.array_equal(ps.Surface(sim, group, 1).mesh()[0], fluid_mesh[0])
    assert ps.Surface(sim, "stone").smoothing_length == pytest.approx(2.6 * 0.5)
    everything = ps.Surface(sim, [scenes[0]["water"], scenes[0]["stone"]]).mesh()[0]
    assert everything[:, 0].min() < -1 and everything[:, 0].max() > 21


def test_follows_the_simulation(simulated, mesh_of):
    sim = simulated(ps.sample.sphere((0, 0, 0), 3.0, 1.0))
    surface = ps.Surface(sim, spacing=0.5)
    before = surface.mesh()[0]
    shift = np.array([4.0, 0.0, 0.0])
    sim.position = sim.position + shift
    assert np.allclose(surface.mesh()[0], before + shift, atol=1e-5)


def test_no_particles(simulated, mesh_of):
    for x in (np.zeros((0, 3)), ps.sample.sphere((0, 0, 0), 2.0, 1.0)):
        points, triangles, normals = ps.Surface(simulated(x), []).mesh()
        assert points.shape == triangles.shape == normals.shape == (0, 3)
        assert triangles.dtype == np.int32 and points.dtype == normals.dtype == np.float32


def test_bad_arguments(refused, simulated, lattice, mesh_of):
    sim = simulated(lattice(4, 4, 4))
    with refused("Surface: spacing must be above 0"):
        ps.Surface(sim, spacing=0.0)
    with refused("Surface: spacing must be at least 0.013"):
        ps.Surface(sim, spacing=1e-9)
    with refused("Surface: threshold must be above 0"):
        ps.Surface(sim, threshold=-1.0)
    with refused("Surface: smooth must be at most 1"):
        ps.Surface(sim, smooth=1.5)
    with refused("Surface: smoothing_length must be above 0"):
        ps.Surface(sim, smoothing_length=0.0)
    with refused("Surface: world must be from 0 to 0, got 1"):
        ps.Surface(sim, world=1)
    with refused("Surface: group must belong to the scene"):
        ps.Surface(sim, ps.Scene().add_particles([(0, 0, 0)]))
    with refused("Surface: smoothing_length must be given"):
        ps.Surface(simulated(lattice(2, 2, 2), spacing=0.0))


@pytest.mark.parametrize(
    "gone", [{"anisotropic": True}, {"method": "marching_cubes"}, {"node_limit": 9}, {"h": 1.0}]
)
def test_what_is_not_there_any_more_says_what_to_do(refused, gone, simulated, lattice):
    with refused(f"Surface: {next(iter(gone))} must be left out", kind=TypeError):
        ps.Surface(simulated(lattice(2, 2, 2)), **gone)


def test_positions_that_cannot_be_drawn(refused, simulated, lattice, mesh_of):
    sim = simulated(lattice(4, 4, 4))
    surface = ps.Surface(sim)
    x = sim.get("position")
    for bad, words in ((np.nan, "position must be finite.*particle 7 of world 0"),
                       (1e7, "spacing must be at least the fluid's extent over")):  # fmt: skip
        x[7, 1] = bad
        sim.state.position.assign(x)
        with refused(words):
            surface.mesh()


def test_without_the_library(monkeypatch, refused, simulated, lattice):
    monkeypatch.setitem(sys.modules, "pysplashsurf", None)
    with refused(r"pysplashsurf must be installed.*pip install 'particlesim\[surface\]'",
                 kind=ImportError):  # fmt: skip
        ps.Surface(simulated(lattice(2, 2, 2)))
