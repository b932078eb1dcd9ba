"""A barostat in a scene: the same bits in any way, lists that follow the box, what is refused."""

import numpy as np
import pytest
from pxr import Usd, UsdGeom

import particlesim as ps
from cases.sampled import SIGMAS, distributed, gamma
from cases.worlds import equal_alone, goes_on_after_reset_and_save
from particlesim.engine.model import Model

PRESSES = ((0.0, 0.4, 1.0), (2.0, 20.0, 1.0))


def liquid(seed=0, cells=3, pressure=PRESSES, cutoff=1.6, **options):
    """Lennard-Jones atoms under a pressure that comes and goes, from another box in each world."""
    count, rng = 4 * cells**3, np.random.default_rng(seed)
    side = (count / 0.7) ** (1 / 3)
    scene = ps.Scene(periodic=((-1.0, 0.5, 0.0), (side - 1.0, side + 0.5, side)))
    x = ps.sample.lattice("fcc", (cells,) * 3, side / cells) + rng.normal(0, 0.03, (count, 3))
    atoms = scene.add_particles(x, velocity=ps.sample.maxwell_boltzmann(count, 1.0, 1.0, seed=seed))
    scene.add_interaction(ps.LennardJones(atoms, cutoff=cutoff, truncation="shift"))
    scene.add_thermostat(ps.Langevin(atoms, temperature=1.0, friction=1.0, seed=seed))
    given = {"compressibility": 0.1, "relaxation_time": 0.4, "interval": 3, "seed": seed}
    scene.add_barostat(ps.CellRescaling(pressure=pressure, **{**given, **options}))
    return scene


def simulate(scenes, device="cpu", **knobs):
    chosen = {"dt": 0.02, "substeps": 4, "integrator": "velocity_verlet", **knobs}
    return ps.Simulation(scenes, ps.Settings(**chosen), device=device)


@pytest.fixture(scope="module")
def scenes():
    # Worlds of several sizes, seeds and pressures; the last is sorted by a grid.
    return [liquid(1), liquid(2, pressure=5.0), liquid(3, cells=6)]


@pytest.mark.slow
def test_the_same_bits_in_a_batch_or_alone(scenes):
    together = equal_alone(simulate, scenes, "cpu", 5)
    assert (np.abs(together.diagnostics().volume / [154.3, 154.3, 1234.3] - 1) > 0.003).all()


def test_the_same_bits_by_graph_and_by_threads(scenes):
    ends = []
    ways = [{"execution": "graph"}, *({"execution": "threads", "threads": n} for n in (1, 2))]
    for way in ways:
        sim = simulate([*scenes, liquid(4, cells=9)], **way)
        sim.run(3)
        ends.append((sim.position, sim.velocity, sim.model.box_length))
    for other in ends[1:]:
        for one, more in zip(ends[0], other, strict=True):
            np.testing.assert_array_equal(more, one)


def test_the_same_bits_after_a_reset_and_a_restart(scenes, tmp_path):
    goes_on_after_reset_and_save(simulate, scenes, "cpu", tmp_path / "a.npz")
    sim = simulate(scenes)
    sim.run(7)
    sim.save(tmp_path / "b.npz")
    loaded = ps.Simulation.load(tmp_path / "b.npz", scenes, device="cpu")
    np.testing.assert_array_equal(loaded.model.box_length, sim.model.box_length)
    assert not np.array_equal(sim.model.box_length, sim.model.box_start)
    sim.reset()
    np.testing.assert_array_equal(sim.model.box_length, sim.model.box_start.astype(np.float32))


@pytest.mark.parametrize(
    "vectorised", [True, pytest.param(False, marks=pytest.mark.slow)], ids=["vectorised", "plain"]
)
def test_lists_follow_the_box(vectorised, monkeypatch):
    monkeypatch.setattr(Model, "vectorised", vectorised)
    monkeypatch.setattr("particlesim.engine.neighbors.verlet.SMALL", 100)  # by a grid
    sim = simulate(liquid(5, cells=4), dt=0.03)
    (listed,) = sim.neighbors.verlet
    lasted, volumes = 0, []
    for _ in range(40):
        sim.step()
        sim.loop.unknown_forces.add(0)
        found = sim.get("force")
        side = sim.model.box_length[0]
        lasted += not np.array_equal(listed.box.numpy()["length"][0], side)
        volumes.append(side.prod())
        x = sim.position.astype(float)
        d = x[:, None] - x
        d -= side * np.round(d / side)
        r = np.linalg.norm(d, axis=2)
        np.fill_diagonal(r, np.inf)
        near = np.where(r < 1.6, r, np.inf)
        size = 48 * near**-14 - 24 * near**-8
        force = (size[..., None] * d).sum(axis=1)
        # Terms go as r^-13, of differences of places up to 8 that are right to eps of these. Of a
        # pair that is overlooked where the force ends there would be 0.79, some thousandth of it.
        scale = np.abs(size * np.where(r < 1.6, r, 0.0)).sum(axis=1).max()
        assert np.abs(found - force).max() < 13 * 8 * np.finfo(np.float32).eps * scale
    # It has been pressed together and let go, by more than the skin of 0.12 of the cutoff, with
    # rows that were made in another box than the present one.
    assert lasted > 10 and max(volumes) > 1.15 * min(volumes)


LOWER, SIDES = np.array([-2.0, 1.0, 0.0]), np.array([2.0, 3.0, 4.0])


def gas():
    """An ideal one."""
    rng = np.random.default_rng(0)
    scene = ps.Scene(periodic=(LOWER, LOWER + SIDES))
    scene.add_particles(
        LOWER + rng.uniform(size=(60, 3)) * SIDES, velocity=rng.normal(size=(60, 3))
    )
    return scene


def piston(scene, **options):
    """A barostat that does not draw, as at no temperature."""
    given = {"pressure": 3.0, "compressibility": 1.0, "relaxation_time": 0.2, "temperature": 0.0}
    scene.add_barostat(ps.CellRescaling(**{**given, **options}))
    return scene


@pytest.mark.parametrize(
    ("precision", "compensated"),
    [
        ("float32", True),
        pytest.param("float32", False, marks=pytest.mark.slow),
        pytest.param("float64", True, marks=pytest.mark.slow),
        pytest.param("float64", False, marks=pytest.mark.slow),
    ],
)
def test_a_gas_is_pressed_together_as_adiabats_say(precision, compensated):
    scene = gas()
    scene.add_particles(LOWER + np.random.default_rng(1).uniform(size=(9, 3)) * SIDES)  # at rest
    piston(scene)
    knobs = {"precision": precision, "compensated": compensated, "ledger": not compensated}
    sim = simulate(scene, dt=0.4, substeps=100, **knobs)
    start = sim.diagnostics()
    x = sim.position[60:] - LOWER
    sim.run(10)
    found = sim.diagnostics()
    # P V^(5/3) stays, to the first order of steps by 0.003 of the volume at most, of which the
    # errors add up to a third of their sum of squares, and ends at the pressure given.
    gone = np.log(start.volume[0] / found.volume[0])
    adiabat = found.pressure[0] / start.pressure[0] * np.exp(-5 / 3 * gone)
    rounding = 1000 * float(np.finfo(precision).eps)  # of a hundred scalings, in each
    assert abs(adiabat - 1) < rounding
    assert found.pressure[0] == pytest.approx(3.0, rel=1e-5 + rounding)
    length = sim.model.box_length[0]
    np.testing.assert_allclose(length / SIDES, length[0] / SIDES[0], rtol=rounding)
    now = sim.position[60:] - LOWER
    np.testing.assert_allclose(now, x * length / SIDES, rtol=0, atol=4 * rounding)
    if not compensated:  # nothing but the piston has done work
        work, gained = sim.ledger()["CellRescaling"].work[0], found.kinetic[0] - start.kinetic[0]
        assert work == pytest.approx(gained, rel=rounding)


def test_volumes_of_an_ideal_gas(device):
    count, worlds, samples, T, P = 32, 300, 4, 1.3, 0.6
    side = (count * T / P) ** (1 / 3)

    def bathed(seed):
        scene = ps.Scene(periodic=((0, 0, 0), (side,) * 3))
        v = np.random.default_rng(seed).normal(0, np.sqrt(T), (count, 3))
        scene.add_particles(np.full((count, 3), 0.5 * side), velocity=v)
        scene.add_thermostat(ps.Langevin(temperature=T, friction=4.0, seed=seed))
        given = {"compressibility": 1 / P, "relaxation_time": 0.5, "interval": 2}
        scene.add_barostat(ps.CellRescaling(pressure=P, seed=seed, **given))
        return scene

    settings = ps.Settings(dt=2.0, substeps=400, integrator="velocity_verlet")
    sim = ps.Simulation([bathed(k) for k in range(worlds)], settings, device=device)
    found = []
    for _ in range(samples):
        sim.run(2)
        found.append(sim.diagnostics().volume * P / T)
    volume, worlds = np.concatenate(found), samples * worlds
    # Of N particles V is distributed as V^N exp(-P V / T), a gamma distribution of N + 1, to which
    # all worlds have come by exp(-8), and of which samples that far apart know nothing of each
    # other. Steps of 0.02 of the relaxation time add a hundredth to the variance.
    distributed(volume, lambda x: gamma(x, 2 * (count + 1)))
    assert abs(volume.mean() - (count + 1)) < SIGMAS * np.sqrt((count + 1) / worlds)
    kurtosis = 6 / (count + 1)
    error = np.sqrt((2 + kurtosis) / worlds)
    assert abs(volume.var() / (count + 1) - 1.01) < SIGMAS * error


def pressed():
    """To less than two cutoffs, from a side of 5.36."""
    return liquid(2, pressure=30.0, cutoff=2.6)


@pytest.mark.filterwarnings("ignore")
def test_a_box_shorter_than_two_cutoffs_is_told():
    with pytest.raises(ps.SimulationError, match=r"\(CellRescaling: the box must stay longer than "
                       r"two cutoffs, 5\.2, got 5\.1\d+; .*look at CellRescaling"):  # fmt: skip
        simulate(pressed()).run(10)


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore")
def test_a_world_that_is_given_up_leaves_the_others_alone(scenes):
    both = simulate([scenes[0], pressed()], on_failure="freeze")
    both.run(10)
    alone = simulate(scenes[0])
    alone.run(10)
    assert {each.world for each in both.incidents} == {1} and 1 in both.frozen
    np.testing.assert_array_equal(both.world(0).position, alone.position)
    assert both.model.box_length[1].min() > 5.2


def test_recordings_have_the_box_of_each_frame(tmp_path):
    sim = simulate(piston(gas(), interval=1))
    sim.run(3, record=tmp_path / "a.npz", history=tmp_path / "a.csv")
    volume = ps.read_history(tmp_path / "a.csv")["volume"][:, 0]
    assert len(set(volume)) == 4
    for k in range(4):
        with np.load(tmp_path / f"a.frames/f.{k:06d}.npz") as frame:
            assert frame["box"].shape == (1, 3)
            assert frame["box"].prod() == pytest.approx(volume[k], rel=1e-12)


@pytest.mark.slow
def test_a_drawing_has_the_box_of_each_frame(tmp_path):
    scene = piston(gas(), interval=1)
    # Across the corner of the box.
    pair = scene.add_particles([LOWER + 0.1, LOWER + SIDES - 0.1])
    scene.add_interaction(ps.Springs([tuple(pair)], stiffness=0.0, rest_length=0.5))
    sim = simulate(scene)
    lengths = []
    recorder = ps.UsdRecorder(sim, tmp_path / "a.usda", frames=2)
    for _ in range(2):
        recorder.write()
        lengths.append(sim.model.box_length[0])
        sim.run(1)
    recorder.close()
    with ps.UsdRecorder(sim, tmp_path / "a.usda", frames=1, resume=1) as recorder:
        recorder.write()
    lengths.append(sim.model.box_length[0])
    stage = Usd.Stage.Open(str(tmp_path / "a.usda"))
    outline = UsdGeom.Boundable(stage.GetPrimAtPath("/World/periodic_box"))
    curves = [UsdGeom.BasisCurves(each) for each in stage.Traverse()]
    (links,) = [each for each in curves if each and each.GetPath() != outline.GetPath()]
    for k, length in enumerate(lengths):
        seen = outline.ComputeWorldBound(k, "default").ComputeAlignedRange()
        np.testing.assert_allclose(seen.GetMin(), LOWER, atol=0.006)
        # With half the width of the lines on each side, 0.002 of the diagonal, some six.
        np.testing.assert_allclose(seen.GetSize() - np.array(length), 0.0, atol=0.012)
        ends = np.array(links.GetPointsAttr().Get(k), float)
        # They go with the box: a tenth from each of its faces, on this side and on that.
        np.testing.assert_allclose(np.abs(ends[1] - ends[0]), 0.2 * length / SIDES, rtol=1e-4)
    assert (np.abs(lengths[2] - SIDES) > 0.01).all()


def test_refused(refused):
    given = {"pressure": 1.0, "compressibility": 1.0, "relaxation_time": 1.0}
    with refused("CellRescaling: compressibility must be above 0"):
        ps.CellRescaling(**{**given, "compressibility": 0.0})
    with refused("CellRescaling: relaxation_time must be above 0"):
        ps.CellRescaling(**{**given, "relaxation_time": 0.0})
    with refused("CellRescaling: interval must be a whole number of at least 1"):
        ps.CellRescaling(interval=0, **given)
    with refused("CellRescaling: pressure must be a number or"):
        ps.CellRescaling(**{**given, "pressure": ((1, 2), (1, 2, 3))})
    with refused("Scene.add_barostat: scene must be periodic along all axes"):
        ps.Scene(periodic=((0, 0, None), (1, 1, None))).add_barostat(ps.CellRescaling(**given))
    with refused("Scene.add_barostat: barostat must be the only one"):
        liquid().add_barostat(ps.CellRescaling(**given))
    with pytest.raises(TypeError, match="barostat must be a Barostat"):
        liquid().add_barostat(ps.Langevin(temperature=1.0, friction=1.0))
    with pytest.raises(TypeError, match="thermostat must be a Thermostat"):
        liquid().add_thermostat(ps.CellRescaling(**given))
    cold = liquid()
    del cold.thermostats[0]
    with refused("CellRescaling: temperature must be given without a thermostat"):
        simulate(cold)
    with refused("integrator must be velocity_verlet or symplectic_euler with Langevin"):
        simulate(liquid(), integrator="yoshida4")
    for add in (
        lambda scene: scene.add_interaction(ps.UniformGravity()),
        lambda scene: scene.add_constraint(ps.Distance([(0, 1)])),
    ):
        stiff = liquid()
        stiff.add_particles([(0, 1, 1)], charge=0.0)
        add(stiff)
        with refused("CellRescaling: scene must hold what follows a box that changes"):
            simulate(stiff)
    held = liquid()
    held.add_particles([(0, 1, 1)], pinned=True)
    with refused("got 'pinned particles'"):
        simulate(held)
