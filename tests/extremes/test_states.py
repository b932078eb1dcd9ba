"""States that are known to have broken one program or another, each bounded and right here."""

import numpy as np
import pytest

import particlesim as ps

EPS = {"float32": 2.0**-23, "float64": 2.0**-52}


# Overlaps ---------------------------------------------------------------------------------------


@pytest.mark.parametrize("gap", [-1.0, -1e-9, 0.0, 5e-9])  # of the centres' distance beyond 1
def test_two_grains_that_overlap_or_almost_touch(gap, precision, device, simulate):
    scene = ps.Scene()
    scene.add_particles([(0, 0, 0), (1 + gap, 0, 0)], radius=0.5)
    scene.add_constraint(ps.Contact())
    sim = simulate(scene, 240, device, substeps=4, precision=precision)
    x, v = sim.position.astype(float), sim.velocity.astype(float)
    apart = np.linalg.norm(x[1] - x[0])
    # Brought apart at no more than one radius a frame, they then fly on with what they have.
    assert apart >= 1 - 8 * EPS[precision]
    assert np.linalg.norm(v, axis=1).max() <= 0.5 * 60 * (1 + 1e-5)
    assert np.abs(v.sum(axis=0)).max() <= 8 * EPS[precision] * max(1.0, np.abs(v).max())
    if gap > -1e-8:
        assert apart <= 1 + 1e-6


def test_atoms_at_random_are_refused_or_keep_their_energy():
    # 300 atoms anywhere in a box: some pairs are at a tenth of sigma, with energies of 4e12.
    scene = ps.Scene(periodic=((0, 0, 0), (7, 7, 7)))
    scene.add_particles(np.random.default_rng(0).uniform(0, 7, (300, 3)))
    scene.add_interaction(ps.LennardJones(cutoff=2.5))
    sim = ps.Simulation(
        scene, ps.Settings(dt=0.005, substeps=1, integrator="velocity_verlet"), device="cpu"
    )
    with pytest.warns(UserWarning, match="LennardJones"), pytest.raises(ps.SimulationError):
        sim.run(20)
    assert np.isfinite(sim.position).all()  # the last good frame


@pytest.mark.parametrize("count", [2, 50])
def test_everybody_in_one_place(count, device, simulate):
    scene = ps.Scene()
    scene.add_particles(np.zeros((count, 3)), radius=0.1)
    scene.add_constraint(ps.Contact())
    sim = simulate(scene, 200, device, substeps=4)
    x = sim.position.astype(float)
    apart = np.linalg.norm(x[:, None] - x[None], axis=2)[~np.eye(count, dtype=bool)]
    assert apart.min() > 0.2 * (1 - 1e-2)


# Masses and stiffnesses -------------------------------------------------------------------------


def test_a_pinned_world_stays(device, simulate):
    scene = ps.Scene()
    x = np.random.default_rng(0).uniform(0, 1, (20, 3))
    scene.add_particles(x, radius=0.2, pinned=True)
    for part in (ps.UniformGravity(), ps.LennardJones(cutoff=2.0), ps.Gravity()):
        scene.add_interaction(part)
    scene.add_constraint(ps.Contact())
    scene.add_constraint(ps.Distance([(0, 1)], rest_length=3.0))
    sim = simulate(scene, 5, device)
    np.testing.assert_array_equal(sim.position, x.astype(np.float32))
    assert not sim.velocity.any()


def test_atoms_without_energy_fly_freely(device, simulate):
    scene = ps.Scene()
    scene.add_particles([(0, 0, 0), (0.5, 0, 0)], velocity=[(1, 0, 0), (-1, 0, 0)])
    scene.add_interaction(ps.LennardJones(epsilon=0.0, cutoff=2.5))
    sim = simulate(scene, 60, device, integrator="velocity_verlet")
    np.testing.assert_array_equal(sim.velocity, [(1, 0, 0), (-1, 0, 0)])
    np.testing.assert_allclose(sim.position[:, 0], [1.0, -0.5], rtol=1e-6)


@pytest.mark.parametrize("ratio", [1e3, 1e6])
@pytest.mark.parametrize("heavy_first", [True, False])
def test_collision_of_very_different_masses(ratio, heavy_first, precision, device, simulate):
    masses = (ratio, 1.0) if heavy_first else (1.0, ratio)
    scene = ps.Scene()
    scene.add_particles([(-1, 0, 0), (1, 0, 0)], velocity=[(1, 0, 0), (-1, 0, 0)], mass=masses,
                        radius=0.1)  # fmt: skip
    scene.add_constraint(ps.Contact(restitution=1.0))
    sim = simulate(scene, 90, device, precision=precision)
    m = np.array(masses)
    v0 = np.array([1.0, -1.0])
    center = (m * v0).sum() / m.sum()
    # Elastic: velocities are mirrored at that of the centre of mass. The correction of a substep
    # is a few digits less exact than the velocities, which have it over dt.
    np.testing.assert_allclose(sim.velocity[:, 0], 2 * center - v0, atol=2e3 * EPS[precision])


@pytest.mark.parametrize("compliance", [0.0, 1e-12])
def test_a_light_chain_with_a_heavy_end(compliance, precision, device, simulate):
    # 1000 : 1. A stiff chain is solved link by link; with many iterations the end hangs where the
    # links are: it may stretch a little while it converges, but never further than it fell freely.
    count, ratio = 6, 1e3
    scene = ps.Scene()
    scene.add_particles(
        [(0, -0.1 * k, 0) for k in range(count)],
        mass=[1e-3] * (count - 1) + [1e-3 * ratio], pinned=[True] + [False] * (count - 1),
    )  # fmt: skip
    scene.add_interaction(ps.UniformGravity())
    scene.add_constraint(ps.Distance([(k, k + 1) for k in range(count - 1)], compliance=compliance))
    sim = simulate(scene, 60, device, substeps=20, iterations=20, precision=precision)
    links = np.linalg.norm(np.diff(sim.position.astype(float), axis=0), axis=1)
    assert links.max() < 0.1 * 1.05
    assert np.abs(sim.position[:, [0, 2]]).max() < 1e-6


def test_cloth_at_the_density_of_silk(device, simulate):
    # 50 g/m^2 at 1 cm: 5 mg a particle, without compliance.
    n = 12
    k = np.arange(n * n).reshape(n, n)
    pairs = [*zip(k[:-1].ravel(), k[1:].ravel(), strict=True),
             *zip(k[:, :-1].ravel(), k[:, 1:].ravel(), strict=True)]  # fmt: skip
    scene = ps.Scene()
    x = 0.01 * np.stack([k // n, 0 * k, k % n], axis=-1).reshape(-1, 3)
    scene.add_particles(x, mass=5e-6, pinned=np.isin(k.ravel(), (0, n - 1)))
    scene.add_interaction(ps.UniformGravity())
    scene.add_constraint(ps.Distance(pairs))
    sim = simulate(scene, 60, device, substeps=20, iterations=4)
    x = sim.position.astype(float)
    links = np.linalg.norm(x[[p[0] for p in pairs]] - x[[p[1] for p in pairs]], axis=1)
    assert links.max() < 0.0105
    assert -0.2 < x[:, 1].min() < -0.01


def test_water_and_air(device):
    # A dense drop in a thin gas of the same spacing, 1000 : 1 in mass: nothing is blown away.
    x = ps.sample.box((0, 0, 0), (0.9, 0.9, 0.9), 0.1)
    inside = np.linalg.norm(x - 0.45, axis=1) < 0.25
    scene = ps.Scene(periodic=((0, 0, 0), (0.9, 0.9, 0.9)))
    scene.add_particles(x, mass=np.where(inside, 1.0, 1e-3))
    scene.add_interaction(
        ps.SPH(smoothing_length=0.13, equation_of_state=ps.Polytrope(1e-3, 1.0),
               viscosity=ps.ArtificialViscosity(0.5))
    )  # fmt: skip
    sim = ps.Simulation(scene, ps.Settings(dt=0.01, substeps=10), device=device)
    before = sim.diagnostics()
    sim.run(20)
    after = sim.diagnostics()
    assert np.abs(after.momentum).max() < 1e-5
    assert after.energy[0] <= before.energy[0] * (1 + 1e-3)


# Far away and long ago --------------------------------------------------------------------------


@pytest.mark.parametrize("distance", [1e3, 1e4, 1e5])
def test_a_spring_far_from_the_origin(distance, device, simulate):
    def stretch(offset):
        scene = ps.Scene()
        scene.add_particles(np.array([(0, 0, 0), (1.5, 0, 0)]) + offset)
        scene.add_interaction(ps.Springs([(0, 1)], stiffness=10.0, rest_length=1.0))
        sim = simulate(scene, 30, device, substeps=20, integrator="velocity_verlet")
        return np.diff(sim.position.astype(float)[:, 0])[0], sim.velocity[:, 0]

    near, v_near = stretch(0.0)
    far, v_far = stretch(np.array([distance, 0, 0]))
    # The distance is known to a few last bits of the position; as a wrong length of the spring it
    # moves the velocities by omega times that.
    bits = 4 * EPS["float32"] * distance
    assert abs(far - near) < bits
    np.testing.assert_allclose(v_far, v_near, atol=np.sqrt(20) * bits)


@pytest.mark.parametrize("offset", [-1e3, -1e5, 1e5])
def test_a_pile_far_from_the_origin(offset, device, simulate):
    x = ps.sample.lattice("sc", (3, 3, 3), 0.55)
    scene = ps.Scene()
    scene.add_particles(x + np.array((offset, 0.25, -offset)), radius=0.25)
    scene.add_interaction(ps.UniformGravity())
    scene.add_constraint(ps.Contact(friction=0.5))
    scene.add_constraint(ps.PlaneBoundary((0, 0, 0), (0, 1, 0), friction=0.5))
    sim = simulate(scene, 60, device, substeps=10)
    bits = 4 * EPS["float32"] * abs(offset)
    assert sim.position[:, 1].min() > 0.25 - 1e-3
    assert np.abs(sim.position[:, 0] - offset).max() < 2.0 + bits
    assert np.linalg.norm(sim.velocity, axis=1).max() < 1.0


@pytest.mark.parametrize("gap", [1e6, 1e9])
def test_cells_far_beyond_any_grid(gap, device):
    # Three pairs, 2^20 cells apart and more, negative too.
    centers = np.array([(-gap, gap, 0), (0, 0, 0), (gap, 0, -gap)])
    apart = np.array((0, 0, 1.2 * max(1.0, gap * 2.0**-22)))
    x = np.concatenate([centers, centers + apart])
    scene = ps.Scene()
    scene.add_particles(x)
    scene.add_interaction(ps.LennardJones(cutoff=2.5))
    sim = ps.Simulation(scene, ps.Settings(precision="float64"), device=device)
    r = np.linalg.norm(x[:3] - x[3:], axis=1)
    expected = (4 * (r**-12.0 - r**-6.0))[r < 2.5].sum()
    np.testing.assert_allclose(sim.diagnostics().potential, expected, rtol=1e-6)


def test_particles_that_leave_are_followed(device, simulate):
    x = np.concatenate([ps.sample.lattice("sc", (10, 10, 10), 1.1), [(5, 5, 30)]])
    v = np.zeros_like(x)
    v[-1] = (0, 0, 1e4)
    scene = ps.Scene()
    scene.add_particles(x, velocity=v)
    scene.add_interaction(ps.LennardJones(cutoff=2.5))
    sim = simulate(scene, 60, device, substeps=5, integrator="velocity_verlet")
    np.testing.assert_allclose(sim.position[-1], (5, 5, 30 + 1e4), rtol=1e-5)
    assert np.abs(sim.position[:-1]).max() < 20


def test_outside_a_periodic_box_is_inside_it(device):
    x = ps.sample.lattice("fcc", (4, 4, 4), 1.7)
    shifts = 6.8 * np.random.default_rng(0).integers(-1000, 1000, x.shape)
    energies = []
    for start in (x, x + shifts):
        scene = ps.Scene(periodic=((0, 0, 0), (6.8, 6.8, 6.8)))
        scene.add_particles(start)
        scene.add_interaction(ps.LennardJones(cutoff=2.5))
        sim = ps.Simulation(scene, ps.Settings(precision="float64"), device=device)
        energies.append(sim.diagnostics().potential[0])
    assert energies[1] == pytest.approx(energies[0], rel=1e-10)
