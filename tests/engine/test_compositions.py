"""Methods of several stages: closed forms, measured orders, limits, and what they cannot take."""

import numpy as np
import pytest

import particlesim as ps
from cases.closed_forms import harmonic, trap
from cases.worlds import equal_alone, goes_on_after_reset_and_save
from particlesim.engine.integrators import METHODS
from particlesim.engine.limit import composed_phase

COMPOSED = ("yoshida4", "yoshida6")


def kepler(method, steps, e=0.5):
    """One orbit, a = G M = 1: the distance from the start at its end, and the largest |dE/E|."""
    scene = ps.Scene()
    scene.add_particles([(0, 0, 0)], pinned=True)
    scene.add_particles([(1 - e, 0, 0)], velocity=(0, np.sqrt((1 + e) / (1 - e)), 0))
    scene.add_interaction(ps.Gravity(G=1.0))
    settings = ps.Settings(
        dt=2 * np.pi / 20, substeps=steps // 20, integrator=method, precision="float64"
    )
    sim = ps.Simulation(scene, settings, device="cpu")
    worst = 0.0
    for _ in range(20):
        sim.step()
        worst = max(worst, abs(sim.diagnostics().energy[0] / -0.5 - 1))
    return np.linalg.norm(sim.position[1] - (1 - e, 0, 0)), worst


@pytest.mark.parametrize(("method", "steps"), [("yoshida4", 800), ("yoshida6", 400)])
def test_kepler_at_the_stated_order(method, steps):
    # e = 0.5. At these steps the next order changes the slope by less than 0.1, and the errors,
    # 1e-10 and more, are far above what rounding makes of a thousand steps, 1e-13.
    coarse, fine = kepler(method, steps), kepler(method, 2 * steps)
    order = METHODS[method].order
    assert np.log2(coarse[0] / fine[0]) == pytest.approx(order, abs=0.1)
    assert np.log2(coarse[1] / fine[1]) == pytest.approx(order, abs=0.1)


@pytest.mark.slow
@pytest.mark.parametrize("method", COMPOSED)
def test_energy_stays_where_it_is(method):
    # Symplectic and symmetric: the energy error of the first orbits of 400 steps does not grow in
    # 100. Where within an orbit the frames fall turns slowly, and changes the largest a little.
    scene = ps.Scene()
    scene.add_particles([(0, 0, 0)], pinned=True)
    scene.add_particles([(0.5, 0, 0)], velocity=(0, np.sqrt(3.0), 0))
    scene.add_interaction(ps.Gravity(G=1.0))
    dt = 2 * np.pi / 20
    settings = ps.Settings(dt=dt, substeps=20, integrator=method, precision="float64")
    sim = ps.Simulation(scene, settings, device="cpu")
    off = np.zeros((100, 20))
    for orbit in range(100):
        for k in range(20):
            sim.step()
            off[orbit, k] = abs(sim.diagnostics().energy[0] / -0.5 - 1)
    assert off[-10:].max() < 1.2 * off[:10].max()


@pytest.mark.parametrize("method", COMPOSED)
def test_the_limit_is_where_the_transfer_matrix_leaves_the_unit_circle(method):
    stages, phase = METHODS[method].stages, composed_phase(METHODS[method].stages)

    def largest(theta):
        matrix = np.eye(2)
        for w in stages:
            kick = np.array([[1, 0], [-0.5 * w * theta, 1]])
            matrix = kick @ np.array([[1, w * theta], [0, 1]]) @ kick @ matrix
        return np.abs(np.linalg.eigvals(matrix)).max()

    below = max(largest(theta) for theta in np.linspace(0.01, phase * (1 - 1e-9), 1000))
    # A double eigenvalue is resolved to the root of the rounding of the entries, 1e-15.
    assert below < 1 + 1e-7 and largest(phase * 1.001) > 1.001
    assert phase == pytest.approx({"yoshida4": 1.573, "yoshida6": 2.269}[method], abs=5e-4)


@pytest.mark.parametrize("method", COMPOSED)
def test_the_limit_is_that_of_runs(method):
    far = {}
    for share in (0.99, 1.01):
        # omega = 1.
        dt = share * composed_phase(METHODS[method].stages)
        knobs = {"precision": "float64", "integrator": method, "watchdog": False}
        sim = ps.Simulation(harmonic(), ps.Settings(dt=200 * dt, substeps=200, **knobs), "cpu")
        assert sim.stability().dt == pytest.approx(dt / share, rel=0.01)
        sim.step()
        sim.step()
        far[share] = np.abs(sim.position).max()
    # Below, an ellipse of bounded axes; above, it grows in each of 400 substeps.
    assert far[0.99] < 30 and far[1.01] > 1e4


def test_drag_is_refused(refused):
    for force in (ps.Drag(1.0), ps.Springs([(0, 1)], 1.0, 1.0, damping=1.0)):
        scene = ps.Scene()
        scene.add_particles([(0, 0, 0), (1, 0, 0)])
        scene.add_interaction(force)
        with refused(f"integrator must be velocity_verlet or .* with {force.name}, which depends"):
            ps.Simulation(scene, ps.Settings(integrator="yoshida4"), device="cpu")
    scene = ps.Scene()
    scene.add_particles([(0, 0, 0), (1, 0, 0)])
    scene.add_interaction(ps.Springs([(0, 1)], 1.0, 1.0))
    ps.Simulation(scene, ps.Settings(integrator="yoshida4"), device="cpu")
    scene.add_constraint(ps.Distance([(0, 1)]))
    with refused(
        "be symplectic_euler or velocity_verlet in a scene with constraints, got 'yoshida4'"
    ):
        ps.Simulation(scene, ps.Settings(integrator="yoshida4"), device="cpu")


class Halves(ps.Integrator):
    """Velocity Verlet, in two stages of half a step each."""

    order = 2
    stages = (0.5, 0.5)
    carries_forces = True

    def begin(self, dt):
        self.move(0.5 * dt, dt)

    def advance(self, dt):
        self.kick(0.5 * dt)


def test_stages_of_ones_own():
    ends = []
    for method, substeps in ((Halves, 4), ("velocity_verlet", 8)):
        settings = ps.Settings(dt=0.5, substeps=substeps, integrator=method)
        sim = ps.Simulation(harmonic(), settings, device="cpu")
        sim.run(3)
        ends.append((sim.position, sim.velocity))
    np.testing.assert_array_equal(ends[0], ends[1])


class Short(Halves):
    stages = (0.5, 0.4)


def test_stages_that_make_no_substep_are_refused(refused):
    with refused("Short: stages must add up to 1"):
        ps.Simulation(harmonic(), ps.Settings(integrator=Short), device="cpu")


def springs(amplitude):
    scene = harmonic(amplitude)
    scene.add_particles([(1, 2, 0), (3, 2, 0.5)])
    scene.add_interaction(ps.ParticleForce(potential=trap, stiffness=2.0))
    return scene


def test_worlds_ways_and_restarts(tmp_path):
    def simulate(scenes, device="cpu", **knobs):
        settings = ps.Settings(dt=0.2, substeps=3, integrator="yoshida4", ledger=True, **knobs)
        return ps.Simulation(scenes, settings, device=device)

    scenes = [springs(1.0), springs(2.0)]
    graph = equal_alone(simulate, scenes, "cpu", 4, execution="graph")
    ledger = graph.ledger()
    # The stages' works add up to the change of the kinetic energy, but for rounding of float32.
    assert np.abs(ledger.unaccounted).max() < 1e-5 * graph.diagnostics().kinetic.max()
    threads = simulate(scenes, execution="threads", threads=2)
    threads.run(2)
    threads.save(tmp_path / "a.npz")
    again = ps.Simulation.load(tmp_path / "a.npz", scenes, device="cpu")
    again.run(2)
    np.testing.assert_array_equal(again.position, graph.position)
    np.testing.assert_array_equal(again.velocity, graph.velocity)


@pytest.mark.slow
def test_a_liquid_with_neighbour_lists(tmp_path, liquid):
    """Rows of neighbours serve stages that go back; batches and restarts give the same bits."""

    def simulate(scenes, device="cpu"):
        settings = ps.Settings(dt=0.1, substeps=10, integrator="yoshida4")
        return ps.Simulation(scenes, settings, device=device)

    scenes = [liquid(5, truncation="force_shift", seed=seed) for seed in (0, 1)]
    equal_alone(simulate, scenes, "cpu", 10)
    goes_on_after_reset_and_save(simulate, scenes, "cpu", tmp_path / "a.npz")


@pytest.mark.slow
def test_a_liquid_keeps_its_energy_to_fourth_order(liquid):
    # In float64, of the fluctuation of the energy while the liquid is in equilibrium: half the step
    # has a sixteenth of it. Another path each, of which 40 times are right to some 15 %: of the
    # ratio to 0.2 sqrt(2) / ln 2 = 0.3 in the order, and the force at the cutoff is smooth but for
    # its slope, which takes some off.
    spread = []
    for substeps in (7, 14):
        settings = ps.Settings(
            dt=0.1, substeps=substeps, integrator="yoshida4", precision="float64"
        )
        sim = ps.Simulation(liquid(5, truncation="force_shift"), settings, device="cpu")
        energy = []
        for _ in range(50):
            sim.step()
            energy.append(sim.diagnostics().energy[0])
        spread.append(np.std(energy[10:]))
    assert np.log2(spread[0] / spread[1]) == pytest.approx(4, abs=0.6)
