"""Explain: a scene has what it requires, and nothing else."""

import numpy as np
import pytest
import warp as wp

import particlesim as ps


def scene_with(*interactions, periodic=None, count=8, **attributes):
    scene = ps.Scene(periodic=periodic)
    side = int(np.ceil(count ** (1 / 3)))
    scene.add_particles(ps.sample.lattice("sc", (side,) * 3, 1.0)[:count], **attributes)
    for interaction in interactions:
        scene.add_interaction(interaction)
    return scene


def explained(scene, device="cpu", **knobs):
    sim = ps.Simulation(scene, ps.Settings(**knobs), device=device)
    return sim, sim.explain()


def kernels(explanation):
    return [name for _, name, _ in explanation.launches]


COMPENSATED = {"position", "velocity", "position_error", "velocity_error"}


def test_a_kinetic_gas_has_no_forces(device):
    _, found = explained(scene_with(), device)
    assert set(found.arrays) == {"position", "velocity", "position_error"}
    assert kernels(found) == ["advance"]
    assert found.lists == []
    assert found.bytes_per_particle == 3 * 12


def test_without_compensation_there_are_no_errors_to_carry(device):
    _, found = explained(scene_with(), device, compensated=False)
    assert set(found.arrays) == {"position", "velocity"}


def test_a_lennard_jones_scene_has_no_density_and_no_previous_position(liquid, device):
    sim, found = explained(liquid(cells=4), device)
    # On a CPU skins follow from how long rows last.
    clock = {"time"} if device == "cpu" else set()
    assert set(found.arrays) == COMPENSATED | {"force", "inverse_mass", "image", "world"} | clock
    for name in ("density", "pressure", "previous_position", "correction", "mass", "radius"):
        assert name not in sim.state
    assert len(found.lists) == 1
    # A list is rebuilt only if something has moved; then slots are in another order.
    names = [name for _, name, _ in found.conditional]
    sums = ["gather", "zero_rows", "sum_over_partners", "advance"]
    if device == "cpu":
        made = ["set_reach", "halve_blocks", "empty_pools", "halve_supers", "find_partners"]
        assert names == ["take_positions", "choose_skins", *made]
        assert kernels(found) == ["flag_moved", "flag_idle", *sums, "tick"]
    else:
        assert names == ["take_positions", "set_reach", "spread", "direct_rows"]
        assert kernels(found) == ["flag_moved", *sums]


def test_a_large_world_has_a_grid_and_a_small_one_has_none(liquid, device):
    if device != "cpu":
        pytest.skip("on CUDA worlds of 8192 particles are small")
    sim, found = explained(liquid(cells=6))
    assert "hash grid" in found.lists[0]
    names = [name for _, name, _ in found.conditional]
    sort = ["lay_columns", "number_bins", "sort_by_bins"]
    rows = ["empty_pools", "halve_supers", "find_partners"]
    assert names == ["take_positions", "choose_skins", "set_reach", *sort, *rows]
    assert "gather" in kernels(found)  # into the grid's order
    assert len(sim.neighbors.lists[0].grids) == 1


def test_without_constraints_there_is_no_constraint_pass(liquid, device):
    sim, found = explained(liquid(cells=4), device)
    assert sim.constraints == []
    assert "follow_corrections" not in found.kernels


def test_without_neighbours_there_is_no_list(device):
    scene = scene_with(ps.UniformGravity(), ps.Drag(1.0), ps.Springs([(0, 1)], 1.0))
    sim, found = explained(scene, device)
    assert found.lists == []
    assert sim.neighbors.lists == []
    assert found.conditional == []
    implicit = {"force_slope", "implicit_force", "velocity_lead"}  # in the velocity, as drag is
    assert set(found.arrays) == COMPENSATED | {"force", "inverse_mass", "mass"} | implicit
    forces = ["particle_force", "particle_force_and_slope", "bonded_force"]
    assert kernels(found) == [*3 * ["zero_rows"], *forces, "respond", "advance"]


def test_without_forces_of_velocity_nothing_is_implicit_or_predicted(device):
    scene = scene_with(ps.UniformGravity(), ps.Gravity())
    _, found = explained(scene, device, integrator="velocity_verlet")
    assert set(found.arrays) == COMPENSATED | {"force", "inverse_mass", "mass"}
    forces = ["particle_force", "sum_over_partners"]
    assert kernels(found) == ["advance", "zero_rows", *forces, "kick_only"]


def test_gravity_looks_at_all_and_keeps_no_rows(device):
    sim, found = explained(scene_with(ps.Gravity()), device)
    assert found.lists == ["all pairs of 8 particles, for Gravity"]
    assert not sim.neighbors.verlet
    assert kernels(found) == ["zero_rows", "sum_over_partners", "advance"]


def test_only_attributes_that_a_law_names_are_on_the_device(device):
    @ps.law
    def coulomb(r: float, charge_i: float, charge_j: float):
        return charge_i * charge_j / r

    scene = scene_with(ps.PairPotential(coulomb, cutoff=1.5), charge=1.0, spin=[(0, 0, 1)] * 8)
    sim, found = explained(scene, device)
    assert "charge" in sim.state
    assert "spin" not in sim.state
    assert found.unread == ["spin"]
    assert "of no part's: spin\n" in str(found)


def test_time_is_kept_only_for_laws_that_ask(device):
    @ps.law
    def swing(time: float):
        return wp.vec3(wp.sin(time), 0.0, 0.0)

    sim, found = explained(scene_with(ps.ParticleForce(swing)), device)
    assert "time" in sim.state
    assert kernels(found) == ["zero_rows", "particle_force", "advance", "tick"]


@pytest.mark.parametrize("method", ["symplectic_euler", "velocity_verlet"])
def test_the_numbers_are_those_of_the_arrays(method, liquid, precision, device):
    sim, found = explained(liquid(cells=4), device, precision=precision, integrator=method)
    n = sim.particle_count
    assert found.arrays.keys() == sim.state.arrays.keys()
    for name, array in sim.state.arrays.items():
        assert found.arrays[name] * n == array.capacity
        assert array.shape[0] == (1 if name == "time" else n)
    lists = sum(each.memory for each in sim.neighbors.lists)
    assert found.bytes_per_particle == pytest.approx(sum(found.arrays.values()) + lists / n)
    assert lists >= sim.neighbors.lists[0].index.capacity
    assert found.launches_per_substep == len(found.launches)
    recorded = [operation.dim for operation in sim.executor.frame.substep.launches()]
    assert sorted(recorded) == sorted(rows for _, _, rows in [*found.launches, *found.conditional])
    assert {owner for owner, _, _ in found.launches} == {"loop", "pair lists", "LennardJones"}


def test_the_report_reads(liquid, device):
    scene = liquid(cells=4)
    scene.add_interaction(ps.UniformGravity())
    scene.add_interaction(ps.Drag(1.0))
    sim = ps.Simulation(scene, ps.Settings(dt=0.1, substeps=5), device=device, worlds=3)
    text = str(sim.explain())
    for part in (
        "3 worlds of 256 particles on",
        "5 substeps of 0.02",
        "position ",
        "12.0 B",
        "pair lists",
        f"a substep: {12 if device == 'cpu' else 10} launches",
        "UniformGravity",
        "when neighbour lists are rebuilt",
        "execution: graph",
    ):
        assert part in text, part
