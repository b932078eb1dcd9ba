"""Fluids and the boundaries that hold them: images, forces, moving walls, starts."""

import itertools

import numpy as np
import pytest
import warp as wp

import particlesim as ps
from cases.gradients import assert_gradient
from cases.worlds import equal_alone, goes_on_after_reset_and_save
from particlesim.engine.model import Model

SIZE = 0.1  # of the particles' lattice
H = 1.3 * SIZE
CORNER = np.array([[1.0, 0, 0], [0, 1.0, 0], [0, 0, 1.0]])


@ps.law
def tube(x: wp.vec3, radius: float):
    return radius - wp.length(wp.vec2(x[0], x[2]))


BOUNDARIES = {
    "box": lambda: [ps.BoxBoundary((0, 0, 0), (1, 2, 1))],
    "planes": lambda: [ps.PlaneBoundary((0, 0, 0), n) for n in CORNER],
    "sphere": lambda: [ps.SphereBoundary((0.3, 0.3, 0.3), 0.62)],
    "cylinder": lambda: [ps.CylinderBoundary((0.3, 0, 0.3), (0.3, 1, 0.3), 0.44, inside=True)],
    "capsule": lambda: [
        ps.PlaneBoundary((0, 0, 0), (0, 1, 0)),
        ps.CapsuleBoundary((-1, -0.3, 0), (2, -0.3, 0), 0.3),
    ],
    "law": lambda: [
        ps.Boundary(tube, radius=1.0), ps.SphereBoundary((0.3, -1, 0.3), 1.05, inside=False)
    ],
}  # fmt: skip


def water(boundaries, jitter=0.2, shift=0.06, speed=0.0, viscosity=None, **options):
    """Somewhat compressed water in a corner, no nearer to it than it rests."""
    random = np.random.default_rng(1)
    x = ps.sample.box((0, 0, 0), (0.6, 0.6, 0.6), SIZE, jitter=jitter, seed=1)
    scene = ps.Scene()
    scene.add_particles(
        np.maximum(x, shift), velocity=speed * random.normal(size=x.shape), mass=1100 * SIZE**3,
        radius=1e-4, group="water",
    )  # fmt: skip
    scene.add_interaction(
        ps.SPH(smoothing_length=H, rest_density=1000.0, equation_of_state=ps.Tait(10.0),
               viscosity=viscosity, **options)
    )  # fmt: skip
    for each in boundaries:
        scene.add_constraint(each)
    return scene


def simulation(scene, precision="float64", device="cpu", **knobs):
    settings = ps.Settings(dt=1e-3, substeps=2, precision=precision, **knobs)
    return ps.Simulation(scene, settings, device=device)


@pytest.mark.parametrize(
    "kind",
    [pytest.param(k, marks=[pytest.mark.slow] * (k not in ("box", "law"))) for k in BOUNDARIES],
)
def test_forces_are_minus_the_gradient_of_the_energy(kind):
    """Beside flat walls and curved ones, in corners and in the middle."""
    scene = water(BOUNDARIES[kind](), shift=0.075)  # so that no wall gives way
    x, sim = scene.position, simulation(scene)
    force = sim.get("force")
    near = np.argsort(x.max(axis=1))[:2]  # in the corner
    for i, axis in itertools.product([*near, 40, 100], range(3)):
        assert_gradient(sim, x, force, i, axis)


@pytest.mark.parametrize("slip", [True, False])
def test_images_are_what_particles_behind_the_walls_would_be(slip):
    """A corner of three planes against the eight octants that it stands for.

    Where the fluid slips their velocities are mirrored, where it sticks opposite.
    """
    walls = ps.BoxBoundary((0, 0, 0), (9, 9, 9), slip=slip)
    scene = water([walls], viscosity=ps.ArtificialViscosity(0.5, 1), speed=1.0)
    sim = simulation(scene)
    signs = np.array(list(itertools.product((1, -1), repeat=3)))
    mirrored = ps.Scene()
    for sign in signs:
        turned = sign if slip else sign.prod()
        mirrored.add_particles(
            sign * scene.position, velocity=turned * scene.velocity, mass=1100 * SIZE**3
        )
    mirrored.add_interaction(scene.interactions[0])
    whole = simulation(mirrored)
    n = scene.particle_count
    for name in ("density", "pressure", "force"):
        found, expected = sim.get(name), whole.get(name)[:n]
        # Sums of 60 terms in another order; the seventh power in the pressure.
        assert np.abs(found - expected).max() < 1e-12 * np.abs(expected).max()
    assert np.isclose(sim.diagnostics().potential[0], whole.diagnostics().potential[0] / 8)
    # What the walls are pressed by is what keeps the momentum of one octant from being kept.
    assert np.allclose(sim.force(walls), -sim.get("force").sum(axis=0), rtol=1e-9)


@pytest.mark.slow
@pytest.mark.parametrize("sticks", [(True, True), (True, False), (False, True)])
def test_walls_bear_together_what_the_fluid_loses(sticks):
    """Also where it sticks to one and slips along the other, and of two kinds of viscosity."""
    walls = [
        ps.PlaneBoundary((0, 0, 0), (1, 0, 0), slip=not sticks[0]),
        ps.BoxBoundary((-9, 0, 0), (9, 9, 9), slip=not sticks[1]),
    ]
    viscosity = [ps.ArtificialViscosity(0.5, 1), ps.LaminarViscosity(0.1)]
    sim = simulation(water(walls, viscosity=viscosity, speed=1.0))
    total = sum(sim.force(each) for each in walls)
    assert np.allclose(total, -sim.get("force").sum(axis=0), rtol=1e-9)


@pytest.mark.parametrize("precision", ["float64", pytest.param("float32", marks=pytest.mark.slow)])
def test_plain_loop_equals_the_vectorised_one(precision, monkeypatch):
    scene = water(BOUNDARIES["box"](), viscosity=ps.ArtificialViscosity(0.5), speed=1.0)
    results = []
    for vectorised in (True, False):
        monkeypatch.setattr(Model, "vectorised", vectorised)
        sim = simulation(scene, precision)
        results.append([sim.get(name) for name in ("density", "pressure", "force")])
    eps = np.finfo(precision).eps
    for ours, theirs in zip(*results, strict=True):
        assert np.abs(ours - theirs).max() < 1000 * eps * np.abs(theirs).max()


def test_a_plane_of_fluid_is_not_held_from_its_sides():
    """A box that closes in a two-dimensional scene along z is no wall of it."""
    found = []
    for depth in (0.05, 5.0):
        scene = ps.Scene()
        x = ps.sample.box((0, 0, 0), (0.6, 0.6, 0), SIZE)
        scene.add_particles(x, mass=1000 * SIZE**2, radius=SIZE / 2)
        scene.add_interaction(
            ps.SPH(smoothing_length=H, rest_density=1000.0, equation_of_state=ps.Tait(10.0),
                   dimension=2)
        )  # fmt: skip
        scene.add_constraint(ps.BoxBoundary((0, 0, -depth), (0.6, 0.6, depth)))
        found.append(simulation(scene).get("density"))
    assert np.array_equal(*found)
    # A full box is as dense as a lattice without end: all of it is as the middle.
    assert np.ptp(found[0]) < 1e-10 * found[0].max()


def test_what_starts_in_a_wall_comes_out_of_it_gently():
    """A box that is no whole number of spacings wide: its last layer starts half in the wall."""
    spacing = 0.04
    scene = ps.Scene()
    x = ps.sample.box((0, 0, 0), (0.4, 0.4, 0.42), spacing)  # from 0.01 on along z
    scene.add_particles(x, mass=1000 * spacing**3, radius=0.001)
    scene.add_interaction(
        ps.SPH(smoothing_length=1.3 * spacing, rest_density=1000.0, equation_of_state=ps.Tait(45.0),
               viscosity=ps.ArtificialViscosity(0.1))
    )  # fmt: skip
    scene.add_constraint(ps.BoxBoundary((0, 0, 0), (0.4, 1, 0.42)))
    sim = ps.Simulation(scene, ps.Settings(dt=1 / 60, substeps=20), device="cpu")
    assert sim.diagnostics().potential[0] < 1e-6
    fastest = 0.0
    for _ in range(30):
        sim.step()
        fastest = max(fastest, float(np.linalg.norm(sim.velocity, axis=1).max()))
    # 5 % of compression at once would throw it at up to 0.05 c = 2 m/s. It is called in over 0.5 s,
    # along which it gives way upwards.
    assert fastest < 0.3
    assert np.sort(sim.position[:, 2])[:100].mean() > 0.0115


@pytest.mark.slow
def test_a_piston_does_work_on_a_gas():
    """P V^gamma along an adiabat: what the piston spends is what the gas has gained."""
    count, gamma = 24, 5 / 3
    spacing = 1 / count
    scene = ps.Scene(periodic=((None, 0, None), (None, 8 * spacing, None)))
    x = ps.sample.box((0, 0, 0), (1, 8 * spacing, 0), spacing)
    gas = scene.add_particles(x, mass=spacing**2, radius=1e-6)
    scene.add_interaction(
        ps.SPH(gas, smoothing_length=1.6 * spacing, dimension=2,
               equation_of_state=ps.Polytrope(1.0, index=1 / (gamma - 1)))
    )  # fmt: skip
    scene.add_constraint(ps.PlaneBoundary((0, 0, 0), (1, 0, 0)))
    speed, frames = 0.02, 10
    piston = scene.add_constraint(ps.PlaneBoundary((1, 0, 0), (-1, 0, 0), velocity=(-speed, 0, 0)))
    settings = ps.Settings(dt=1.0, substeps=400, precision="float64")
    sim = ps.Simulation(scene, settings, device="cpu")
    start, work = sim.diagnostics().energy[0], 0.0
    before = sim.force(piston)[0]
    for _ in range(frames):
        sim.step()
        now = sim.force(piston)[0]
        work += 0.5 * (before + now) * speed * settings.dt
        before = now
    gained = sim.diagnostics().energy[0] - start
    # K rho^(gamma - 1) / (gamma - 1) per mass, rho = 1 / (1 - speed t) of its start; what moves has
    # (speed / c)^2 = 2e-4 of it, and W smooths the density of a lattice by some 1e-3.
    area = 8 * spacing
    s = 1 / (1 - speed * frames * settings.dt)
    expected = area / (gamma - 1) * (s ** (gamma - 1) - 1)
    assert gained == pytest.approx(expected, rel=0.01)
    assert work == pytest.approx(gained, rel=0.02)  # sampled once a frame, with sound in it


@pytest.mark.slow
def test_bits(tmp_path, device):
    """Threads, batches, resets and restarts, with a start in the walls and one that moves."""

    def scene(shift):
        made = water(
            [ps.BoxBoundary((0, 0, 0), (1, 2, 1), velocity=(0.1, 0, 0))], shift=0.02, speed=shift
        )
        return made

    def simulate(scenes, device=device, **knobs):
        return simulation(scenes, "float32", device, **knobs)

    scenes = [scene(0.1), scene(0.2)]
    equal_alone(simulate, scenes, device, 5)
    goes_on_after_reset_and_save(simulate, scenes, device, tmp_path / "walls.npz")
    one, two = (simulate(scenes[0], threads=threads) for threads in (1, 2))
    one.run(5)
    two.run(5)
    assert np.array_equal(one.position, two.position)
