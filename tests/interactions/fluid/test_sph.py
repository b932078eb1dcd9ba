"""SPH: conservation, coincident particles, worlds, and what it refuses."""

import functools

import numpy as np
import pytest

import particlesim as ps
from cases.worlds import equal_alone
from particlesim.interactions.fluid.smoothing import SMOOTHING

EPSILON = {"float32": 2.0**-24, "float64": 2.0**-53}
SIDE = np.array([4.0, 5.0, 6.0])
H = 0.7
OFTEN = ("cubic_spline", "wendland_c2")
NAMES = [
    *OFTEN,
    *(pytest.param(each, marks=pytest.mark.slow) for each in sorted({*SMOOTHING} - {*OFTEN})),
]


@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("tension", [False, True])
def test_force_is_the_gradient_of_the_energy(name, tension, cloud, fluid, prepared):
    x, _, m = cloud(60)
    x *= 0.4
    equation = ps.Tait(10.0, negative_pressure=tension)
    sim = prepared(fluid(x, m=m, smoothing=name, equation_of_state=equation))
    force, step = sim.get("force"), 1e-6
    for particle, axis in [(0, 0), (7, 1), (33, 2)]:
        energies = []
        for side in (step, -step):
            moved = x.copy()
            moved[particle, axis] += side
            sim.position = moved
            energies.append(sim.diagnostics().potential[0])
        derived = -(energies[0] - energies[1]) / (2 * step)
        # Central difference: step^2 / 6 (7 / h)^2, and the energies' round-off over the step.
        tolerance = step**2 * 20 * np.abs(force).max() + 1e-15 * energies[0] / step
        assert abs(force[particle, axis] - derived) < 10 * tolerance


def test_momentum_and_angular_momentum_are_conserved(precision, device, cloud, fluid):
    x, v, m = cloud()
    scene = fluid(x, v, m, viscosity=ps.ArtificialViscosity(0.5, 1.0))
    sim = ps.Simulation(scene, ps.Settings(dt=0.05, substeps=50, precision=precision), device)
    before = sim.diagnostics()
    sim.step()
    after = sim.diagnostics()
    # 50 steps of 300 kicks, each rounded relative to the force: the sum of |f| dt is what rounds.
    sim.forces(0.0)
    force, eps = np.linalg.norm(sim.get("force"), axis=1), EPSILON[precision]
    impulse = 10 * force.sum() * 0.05 + 10 * (m * np.linalg.norm(v, axis=1)).sum()
    assert np.abs(after.momentum - before.momentum).max() < 10 * eps * impulse
    change = np.abs(after.angular_momentum - before.angular_momentum).max()
    assert change < 10 * eps * impulse * np.linalg.norm(SIDE)
    assert np.abs(after.momentum - before.momentum).max() > 0  # something has happened


@pytest.mark.slow
def test_viscosity_takes_energy_out(cloud, fluid):
    x, v, m = cloud()
    box = ((0, 0, 0), SIDE)

    def drift(viscosity):
        scene = fluid(
            x, v, m, box, viscosity=viscosity,
            equation_of_state=ps.Tait(10.0, negative_pressure=True),
        )  # fmt: skip
        settings = ps.Settings(
            dt=0.02, substeps=80, precision="float64", integrator="velocity_verlet"
        )
        sim = ps.Simulation(scene, settings, device="cpu")
        start = sim.diagnostics().energy[0]
        sim.step()
        return (sim.diagnostics().energy[0] - start) / start

    assert abs(drift(None)) < 1e-3
    assert drift(ps.ArtificialViscosity(1.0, 2.0)) < -0.02


def test_coincident_particles_part(precision, device, fluid, prepared):
    """Two, and three, at one place: finite, opposite pushes, and apart soon."""
    far = np.full((1, 3), 3.0)
    x = np.concatenate([np.zeros((2, 3)), far, far, far])
    scene = fluid(x, m=0.5, viscosity=ps.ArtificialViscosity(0.1))
    sim = prepared(scene, precision, device)
    force = sim.get("force")
    assert np.all(np.isfinite(force)) and np.linalg.norm(force[0]) > 0
    assert np.all(force[0] == -force[1])
    assert np.abs(force[2:].sum(axis=0)).max() <= 4 * EPSILON[precision] * np.abs(force).max()
    sim.run(60)
    position = sim.position
    gaps = np.linalg.norm(position[:, None] - position[None], axis=2)[np.triu_indices(5, 1)]
    assert gaps.min() > 0.1 * H


@pytest.mark.parametrize("dimension", [1, 2])
def test_coincident_particles_part_within_their_plane(dimension, fluid, prepared):
    scene = fluid(np.zeros((3, 3)), dimension=dimension)
    sim = prepared(scene)
    sim.run(10)
    assert np.ptp(sim.position[:, 0]) > 0
    assert np.all(sim.position[:, dimension:] == 0)


def test_worlds_have_their_own_parameters_and_equal_each_alone(cloud, fluid):
    x, v, m = cloud()

    def build(k):
        return fluid(
            x, v, m, smoothing_length=0.5 + 0.1 * k, rest_density=1.0 + 0.2 * k,
            equation_of_state=ps.Tait(10.0 + k, exponent=7.0 - k),
            viscosity=ps.ArtificialViscosity(0.1 * k, 0.2 * k),
        )  # fmt: skip

    settings = ps.Settings(dt=0.01, substeps=5)
    simulate = functools.partial(ps.Simulation, settings=settings)
    batch = equal_alone(simulate, [build(k) for k in range(3)], "cpu", 2)
    assert np.ptp(batch.diagnostics().potential) > 0


def test_threads_and_graph_agree_bit_for_bit(cloud, fluid):
    x, v, m = cloud(3000)
    results = []
    for execution, threads in [("graph", 1), ("threads", 1), ("threads", 2)]:
        # A random cloud bursts at speeds that depend on the step, whichever way it is run.
        settings = ps.Settings(
            dt=0.002, substeps=4, execution=execution, threads=threads, watchdog=False
        )
        scene = fluid(x, v, m, viscosity=ps.ArtificialViscosity(0.5))
        sim = ps.Simulation(scene, settings, device="cpu")
        sim.run(2)
        results.append(np.concatenate([sim.position, sim.velocity]))
    assert np.all(results[0] == results[1]) and np.all(results[0] == results[2])


def test_explain_shows_what_it_takes(cloud, fluid):
    x, v, m = cloud(1200)  # enough for slots to have an order of their own
    told = ps.Simulation(fluid(x, v, m), device="cpu").explain()
    assert {"density", "pressure", "mass"} <= set(told.arrays)
    assert "correction" not in told.arrays
    gathers = [name for _, name, _ in told.launches if "gather" in name]
    viscous = fluid(x, v, m, viscosity=ps.ArtificialViscosity(0.5))
    told_viscous = ps.Simulation(viscous, device="cpu").explain()
    more = [name for _, name, _ in told_viscous.launches if "gather" in name]
    assert len(more) == len(gathers) + 1  # the velocities, which only a viscosity asks for
    assert sum(who == "SPH" for who, _, _ in told.launches) == 2


@pytest.mark.parametrize("count", [0, 1])
def test_no_particle_and_one(count, precision, device, fluid, prepared):
    sim = prepared(fluid(np.zeros((count, 3)), m=2.0), precision, device)
    sim.run(2)
    expected = 2.0 * SMOOTHING["wendland_c2"].in_dimension(3).sigma / H**3
    assert np.allclose(sim.get("density"), expected) and np.all(sim.get("force") == 0)
    assert np.isfinite(sim.diagnostics().energy).all()


# What it refuses ------------------------------------------------------------------------------

GOOD = {"smoothing_length": 0.1, "rest_density": 1.0, "equation_of_state": ps.Tait(1.0)}


@pytest.mark.parametrize(
    "bad, kind, message",
    [
        ({"smoothing_length": 0.0}, ValueError,
         r"SPH: smoothing_length must be above 0 \[length\], got 0"),
        ({"smoothing_length": np.inf}, ValueError, "SPH: smoothing_length must be finite"),
        ({"rest_density": -1.0}, ValueError, "SPH: rest_density must be above 0"),
        ({"rest_density": None}, ValueError,
         r"SPH: rest_density must be given \[mass/length\^d\], got None; Tait asks for it"),
        ({"smoothing": "cubic"}, ValueError,
         "SPH: smoothing must be one of cubic_spline, quintic_spline, .*spiky, got 'cubic'"),
        ({"dimension": 4}, ValueError, "SPH: dimension must be 1, 2 or 3, got 4"),
        ({"equation_of_state": "tait"}, TypeError,
         "SPH: equation_of_state must be an EquationOfState, got 'tait'"),
        ({"viscosity": 0.1}, TypeError, "SPH: viscosity must be a Viscosity, got 0.1"),
        ({"viscosty": None}, TypeError, "viscosty"),
    ],
)  # fmt: skip
def test_bad_arguments(bad, kind, message):
    with pytest.raises(kind, match=message):
        ps.SPH(**{**GOOD, **bad})


def test_smoothing_length_out_of_the_precision(fluid, prepared):
    scene = fluid(np.zeros((2, 3)), smoothing_length=1e-14)
    with pytest.raises(ValueError, match=r"SPH: smoothing_length must have h.* float32"):
        ps.Simulation(scene, device="cpu")
    assert np.isfinite(prepared(scene, "float64").get("density")).all()


def test_scenes_of_different_fluids_are_no_batch(fluid):
    x = np.zeros((2, 3))
    other = fluid(x, smoothing="cubic_spline")
    with pytest.raises(ValueError, match=r"scenes\[1\].interactions must be of the kinds"):
        ps.Simulation([fluid(x), other], device="cpu")
