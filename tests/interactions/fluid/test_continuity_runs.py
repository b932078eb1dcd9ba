"""Density by continuity: what is refused, bits, steps and walls that move."""

import numpy as np
import pytest

import particlesim as ps
from cases.continuity import SOUND, loose, simulate, stirred
from cases.worlds import equal_alone, goes_on_after_reset_and_save
from particlesim.engine.model import Model


def test_refusals():
    given = {"smoothing_length": 0.1, "rest_density": 1.0, "equation_of_state": ps.Tait(1.0),
             "density": ps.ContinuityDensity()}  # fmt: skip
    for options, words in (
        ({"smoothing_length": ps.AdaptiveSmoothing()}, "one smoothing length"),
        ({"equation_of_state": ps.IdealGas(1.4)}, "without internal energy"),
        ({"viscosity": ps.XSPH()}, "move no particles"),
        ({"rest_density": None, "equation_of_state": ps.Isothermal(1.0)}, "with a rest_density"),
    ):
        with pytest.raises(ValueError, match=words):
            ps.SPH(**(given | options))
    with pytest.raises(TypeError, match="ContinuityDensity"):
        ps.SPH(**(given | {"density": 1000.0}))
    scene = ps.Scene()
    scene.add_particles([(0, 0, 0), (1, 0, 0)], start_density=[1.0, -1.0])
    scene.add_interaction(ps.SPH(**given))
    with pytest.raises(ValueError, match=r"start_density must be above 0.*mind particle 1"):
        ps.Simulation(scene, device="cpu")


def go_on_alike(scenes, path, device, **knobs):
    """In threads, batches and alone, after resets and restarts: bit for bit."""

    def run(scenes, device=device, **more):
        return simulate(scenes, 2, 1e-3, device, **knobs, **more)

    equal_alone(run, scenes, device, 5)
    goes_on_after_reset_and_save(run, scenes, device, path)
    one, two = (run(scenes[0], threads=threads) for threads in (1, 2))
    one.run(5)
    two.run(5)
    for name in ("position", "density"):
        assert np.array_equal(one.get(name), two.get(name))
    one.reset()
    assert np.array_equal(one.get("density"), scenes[0].column("start_density"))


@pytest.mark.slow
def test_bits(cloud, tmp_path, device):
    scenes = [
        loose(*cloud(count, seed=count), np.linspace(0.9, 1.1, count)) for count in (200, 90)
    ]  # fmt: skip
    go_on_alike(scenes, tmp_path / "cloud.npz", device)


@pytest.mark.slow
def test_bits_beside_walls(tmp_path, device):
    """Which move, and come back from a start."""

    def scene(speed):
        x = ps.sample.box((0, 0, 0), (0.6, 0.6, 0.6), 0.1, jitter=0.2, seed=1)
        v = speed * np.random.default_rng(1).normal(size=x.shape)
        made = ps.Scene()
        made.add_particles(
            np.maximum(x, 0.02), velocity=v, mass=1.0, radius=1e-4,
            start_density=np.float32(1000 + 50 * x[:, 1]),
        )  # fmt: skip
        made.add_interaction(
            ps.SPH(smoothing_length=0.13, rest_density=1000.0, equation_of_state=ps.Tait(10.0),
                   viscosity=ps.ArtificialViscosity(0.1), density=ps.ContinuityDensity(0.1))
        )  # fmt: skip
        made.add_constraint(ps.BoxBoundary((0, 0, 0), (1, 2, 1), velocity=(0.1, 0, 0)))
        return made

    scenes = [scene(0.1), scene(0.2)]
    go_on_alike(scenes, tmp_path / "water.npz", device, precision="float32")


@pytest.mark.slow
@pytest.mark.parametrize("integrator", ["symplectic_euler", "velocity_verlet"])
def test_graphs_and_plain_loops_agree(integrator, tmp_path, monkeypatch):
    """Bit for bit with the graph, within rounding with the loops that are not packed."""
    scene, found = stirred(ps.ContinuityDensity(), count=24), []
    for execution in ("graph", "threads"):
        sim = simulate(scene, 10, execution=execution, integrator=integrator)
        sim.run(3)
        found.append(sim.get("density"))
    sim.save(tmp_path / "fluid.npz")
    loaded = ps.Simulation.load(tmp_path / "fluid.npz", scene, device="cpu")
    for each in (sim, loaded):
        each.run(2)
    assert np.array_equal(loaded.get("density"), sim.get("density"))
    assert np.array_equal(*found)
    monkeypatch.setattr(Model, "vectorised", False)
    sim = simulate(scene, 10, integrator=integrator)
    sim.run(3)
    # 30 substeps of sums of 50 terms.
    np.testing.assert_allclose(sim.get("density"), found[0], rtol=30 * 50 * 2.2e-16)


@pytest.mark.slow
@pytest.mark.parametrize("precision", ["float32", "float64"])
def test_a_piston_compresses(precision):
    """What stands between walls is as dense as these have left room for, whoever moves them."""
    spacing, speed = 1 / 16, 0.1
    scene = ps.Scene(periodic=((None, 0, None), (None, 0.5, None)))
    x = ps.sample.box((0, 0, 0), (1, 0.5, 0), spacing)
    scene.add_particles(x, mass=spacing**2, radius=1e-6)
    scene.add_interaction(
        ps.SPH(smoothing_length=2 * spacing, rest_density=1.0, dimension=2,
               equation_of_state=ps.Tait(SOUND), density=ps.ContinuityDensity(),
               viscosity=ps.ArtificialViscosity(1.0))
    )  # fmt: skip
    scene.add_constraint(ps.PlaneBoundary((0, 0, 0), (1, 0, 0)))
    scene.add_constraint(ps.PlaneBoundary((1, 0, 0), (-1, 0, 0), velocity=(-speed, 0, 0)))
    sim = simulate(scene, 200, 1.0, precision=precision)
    sim.run(2)
    # The sound that the piston makes is speed / c = 1 % of it.
    assert sim.get("density").mean() == pytest.approx(1 / 0.8, rel=0.01)
    assert sim.get("density") == pytest.approx(1 / 0.8, rel=0.02)


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore::particlesim.StabilityWarning")
@pytest.mark.parametrize("delta", [0.1, 1.0])
@pytest.mark.parametrize("ratio", [1.3, 2.0])
def test_limit_of_the_step(ratio, delta):
    """Below it noise goes away, and a third above it noise grows."""
    count, ends = 12, []
    x = ps.sample.box((0, 0, 0), (1, 1, 0), 1 / count)
    noise = 1e-6 * np.random.default_rng(0).normal(size=len(x))
    scene = ps.Scene(periodic=((0, 0, None), (1, 1, None)))
    scene.add_particles(x, mass=1 / count**2, start_density=1 + noise)
    scene.add_interaction(
        ps.SPH(smoothing_length=ratio / count, rest_density=1.0, dimension=2,
               equation_of_state=ps.Tait(SOUND, negative_pressure=True),
               density=ps.ContinuityDensity(delta))
    )  # fmt: skip
    (limit,) = (each for each in simulate(scene, 1).stability().limits if each.kind == "sound")
    for part in (0.9, 1.35):
        sim = simulate(scene, 200, 200 * part * limit.dt, watchdog=False)
        sim.run(1)
        ends.append(np.abs(sim.get("density") - 1).max())
    assert ends[0] < 1e-6 and ends[1] > 1e-3
