"""Histories hold what the diagnostics say, and leave the run as it is."""

import csv
import json
import math

import numpy as np
import pytest

import particlesim as ps
from particlesim.instruments.residuals import residuals
from particlesim.output.history.plots import PANELS
from particlesim.output.history.sample import sample
from particlesim.output.history.writer import History, read_history

from .oscillations import OMEGA, STEPS, fluid, oscillation, run

# Values


@pytest.mark.parametrize("suffix", [".csv", ".jsonl"])
def test_a_history_is_the_diagnostics(tmp_path, suffix):
    path = tmp_path / f"out{suffix}"
    found = run(oscillation(worlds=3), path, 4)
    record = read_history(path)
    assert record.frame.tolist() == [0, 1, 2, 3, 4] and record.world_count == 3
    np.testing.assert_allclose(record.time, 0.1 * record.frame, rtol=1e-15)
    # Written with all digits: not rounded at all.
    for name in ("mass", "momentum", "angular_momentum", "kinetic", "potential", "energy"):
        expected = np.array([getattr(each, name) for each in found])
        np.testing.assert_array_equal(record[name], expected)
    np.testing.assert_array_equal(record["potential:Springs"], record["potential"])


def test_what_is_observed_is_recorded(tmp_path, refused):
    scene = ps.Scene(periodic=((0, 0, 0), (2, 2, 2)))
    scene.add_particles([(0, 0, 0), (1, 1, 1)], velocity=[(3, 0, 0), (0, 4, 0)])
    observe = {
        "msd": ps.mean_square_displacement,
        "g": lambda sim: ps.radial_distribution(sim, bins=2, reach=1.0).value,
    }
    sim = ps.Simulation(scene, ps.Settings(dt=0.5, precision="float64"), worlds=2, device="cpu")
    sim.run(4, history=tmp_path / "out.csv", observe=observe)
    record = read_history(tmp_path / "out.csv")
    squares = 12.5 * (0.5 * np.arange(5)) ** 2
    np.testing.assert_allclose(record["observed:msd"], np.stack([squares] * 2, 1), rtol=1e-14)
    assert record["observed:g 1"].shape == (5, 2)
    np.testing.assert_allclose(record["temperature"], 25 / 6, rtol=1e-14)
    np.testing.assert_allclose(record["pressure"], 25 / 24, rtol=1e-14)
    np.testing.assert_allclose(record["stress_xx"], 9 / 8, rtol=1e-14)
    np.testing.assert_allclose(record["stress_yy"], 16 / 8, rtol=1e-14)
    np.testing.assert_array_equal(record["stress_yz"], 0)
    with refused(r"observe\['one'\] must give one value a world, \(2,\), got"):
        History(sim, tmp_path / "other.csv", observe={"one": lambda sim: 1.0}).write()


def test_files_are_what_other_programs_read(tmp_path):
    sim = oscillation(worlds=2)
    for name in ("out.csv", "out.jsonl"):
        with History(sim, tmp_path / name) as history:
            history.write()
    with open(tmp_path / "out.csv", newline="") as file:
        rows = list(csv.DictReader(file))
    assert [(row["frame"], row["world"]) for row in rows] == [("0", "0"), ("0", "1")]
    lines = [json.loads(line) for line in (tmp_path / "out.jsonl").read_text().splitlines()]
    assert [line["energy"] for line in lines] == [float(row["energy"]) for row in rows]


def test_potentials_of_interactions_add_up():
    sim = ps.Simulation(fluid(), ps.Settings(precision="float64"), device="cpu")
    values, total = sample(sim), sim.diagnostics()
    parts = values["potential:UniformGravity"] + values["potential:SPH"]
    # Rounding of sums over 66 particles.
    np.testing.assert_allclose(parts, total.potential, rtol=66 * 2**-52)
    height, mass = sim.position[:, 1], sim.get("mass")
    np.testing.assert_allclose(
        values["potential:UniformGravity"], 9.81 * np.sum(mass * height), rtol=1e-12
    )


def test_density_error_is_that_of_the_fluid():
    sim = ps.Simulation(fluid(), ps.Settings(precision="float64"), device="cpu")
    values = sample(sim)
    # rho_i = sum_j m W(r_ij, h), by brute force with Wendland's C2 of 3D:
    # W = 21 / (16 pi h^3) (1 - q/2)^4 (2 q + 1), q = r / h < 2.
    # The floor at 0.02 gives way to drops at 0.05 by the 0.02 that they lack to half their spacing:
    # it is a mirror at 0.
    x = sim.position[:64]
    both = np.concatenate([x, x * [1, -1, 1]])
    q = np.linalg.norm(x[:, None] - both, axis=2) / 0.2
    weight = 21 / (16 * np.pi * 0.2**3) * np.maximum(1 - q / 2, 0) ** 4 * (2 * q + 1)
    error = weight.sum(axis=1) / 1000 - 1
    # By how much it gives way is kept in single precision: 0.02 2^-24 of h, at a slope of order 1.
    np.testing.assert_allclose(values["density_error_max:SPH"], error.max(), rtol=1e-7)
    rms = np.sqrt(np.mean(error**2))
    np.testing.assert_allclose(values["density_error_rms:SPH"], rms, rtol=1e-7)


def test_residuals_are_those_of_the_geometry():
    scene = fluid()
    scene.add_particles([(2.15, 0.05, 0)], radius=0.1)  # not in the contact's group
    sim = ps.Simulation(scene, ps.Settings(precision="float64"), device="cpu")
    values = sample(sim)
    # The rope starts at 0.5 instead of 0.4; its radii do not touch.
    assert values["residual_max:Distance"] == pytest.approx(0.1, rel=1e-12)
    assert values["residual_max:Contact"] == 0
    # The deepest is the rope's end at height 0 with radius 0.1, over the floor at 0.02.
    assert values["residual_max:BoxBoundary"] == pytest.approx(0.12, rel=1e-12)
    depth = np.maximum(0.02 + sim.get("radius") - sim.position[:, 1], 0.0)
    rms = np.sqrt(np.mean(depth**2))
    assert values["residual_rms:BoxBoundary"] == pytest.approx(rms, rel=1e-12)


def test_overlaps_are_residuals_of_contacts():
    scene = ps.Scene(periodic=((0, 0, 0), (1, None, None)))
    scene.add_particles([(0.05, 0, 0), (0.9, 0, 0), (0.4, 0, 0), (0.45, 0, 0)], radius=0.1)
    scene.add_constraint(ps.Contact())
    sim = ps.Simulation(scene, ps.Settings(precision="float64"), device="cpu")
    missed, world = residuals(sim.constraints[0], sim)
    # Across the periodic face 0.15 apart, and 0.05 apart.
    np.testing.assert_allclose(np.sort(missed), [0.05, 0.05, 0.15, 0.15], rtol=1e-12)
    assert world.tolist() == [0] * 4


def test_inequalities_and_moving_boundaries():
    scene = ps.Scene()
    scene.add_particles([(0, 0, 0), (0, 1, 0), (0, 3, 0)], pinned=True)
    scene.add_constraint(ps.Distance([(0, 1), (1, 2)], rest_length=1.5, tension_only=True))
    scene.add_constraint(ps.PlaneBoundary((0, -1, 0), (0, 1, 0), velocity=(0, 2, 0)))
    sim = ps.Simulation(scene, ps.Settings(dt=0.25, precision="float64"), device="cpu")
    values = sample(sim)
    # The slack rope counts for nothing, the taut one is 0.5 too long; two ropes.
    assert values["residual_max:Distance"] == 0.5
    assert values["residual_rms:Distance"] == pytest.approx(math.sqrt(0.5**2 / 2))
    assert values["residual_max:PlaneBoundary"] == 0
    for _ in range(3):
        sim.step()
    # After 0.75 the plane is at -1 + 1.5.
    assert sample(sim)["residual_max:PlaneBoundary"] == pytest.approx(0.5, rel=1e-12)


def test_energy_of_an_oscillator_is_off_by_a_bounded_part(tmp_path):
    """Velocity Verlet keeps H' = v^2/2 + omega^2 x^2 (1 - (omega dt)^2 / 4) / 2 exactly.

    Started at rest at A: H - H' = omega^2 dt^2 / 8 omega^2 x^2, and H' is kept, so that
    H(t) - H(0) = (omega dt)^2 / 8 omega^2 (x^2 - A^2), between -(omega dt)^2 / 4 H(0) and 0.
    Over H(0) = omega^2 A^2 / 2 that is -(omega dt)^2 / 4 sin^2: about its middle +- (omega dt)^2/8.
    """
    path, substeps = tmp_path / "out.csv", 4
    sim = oscillation(substeps=substeps)
    sim.run(STEPS, history=path)
    record = read_history(path)
    change = record["energy"][:, 0] / record["energy"][0, 0] - 1
    bound = (OMEGA * 0.1 / substeps) ** 2 / 8
    middle = change + bound
    # Rounding of 160 steps and sums: far below the bound of 3e-3.
    assert np.abs(middle).max() <= bound * (1 + 1e-9)
    # At tenths of the period sin^2 is 0 or sin^2(72 degrees) = 0.9045 at most: 1 - 2 * 0.9045.
    assert middle.max() > 0.99 * bound and middle.min() < -0.8 * bound
    drift = PANELS["drift"](record).curves["drift"][:, 0]
    expected = change * record["energy"][0, 0] / record["kinetic"].max()
    # Both subtract numbers of order one, and are of order 1e-3.
    np.testing.assert_allclose(drift, expected, atol=1e-15)


# The run is left as it is


@pytest.mark.parametrize("integrator", ["symplectic_euler", "velocity_verlet"])
def test_a_history_does_not_touch_the_run(tmp_path, liquid, integrator):
    # A liquid that moves on by several skins: measuring renews rows in between.
    settings = ps.Settings(dt=0.05, substeps=10, integrator=integrator)
    scene = liquid(cells=3, cutoff=2.0)
    plain, watched = (ps.Simulation(scene, settings, device="cpu") for _ in range(2))
    plain.run(12)
    watched.run(12, history=tmp_path / "out.csv")
    np.testing.assert_array_equal(plain.position, watched.position)
    np.testing.assert_array_equal(plain.velocity, watched.velocity)


@pytest.mark.slow
def test_density_stays_that_of_the_last_forces(tmp_path):
    plain, watched = (ps.Simulation(fluid(), device="cpu") for _ in range(2))
    plain.run(2)
    watched.run(2, history=tmp_path / "out.csv")
    np.testing.assert_array_equal(plain.get("density"), watched.get("density"))
    np.testing.assert_array_equal(plain.position, watched.position)
