"""Constraints on tuples: gradients, the solve itself, breaking, forces, worlds, extremes."""

import numpy as np
import pytest
import warp as wp

import particlesim as ps
from particlesim.engine import topology

RNG = np.random.default_rng(7)


@ps.law
def distance(a: wp.vec3, b: wp.vec3, rest_length: float):
    """As a user would write Distance."""
    return wp.length(b - a) - rest_length


@ps.law
def angle(a: wp.vec3, b: wp.vec3, c: wp.vec3, rest_angle: float):
    """Angle at b."""
    u, v = wp.normalize(a - b), wp.normalize(c - b)
    return wp.acos(wp.dot(u, v)) - rest_angle


@ps.law
def volume(a: wp.vec3, b: wp.vec3, c: wp.vec3, d: wp.vec3, rest_volume: float = 0.0):
    """Of a tetrahedron."""
    return wp.dot(wp.cross(b - a, c - a), d - a) / 6.0 - rest_volume


@ps.law
def reach(a: wp.vec3, anchor: wp.vec3, length: float):
    """Distance from a point in space."""
    return wp.length(a - anchor) - length


def _angle(x, rest_angle):
    u, v = x[0] - x[1], x[2] - x[1]
    return np.arccos(u @ v / np.linalg.norm(u) / np.linalg.norm(v)) - rest_angle


def _volume(x, rest_volume):
    return np.cross(x[1] - x[0], x[2] - x[0]) @ (x[3] - x[0]) / 6 - rest_volume


def _distance(x, rest_length):
    return np.linalg.norm(x[1] - x[0]) - rest_length


def _reach(x, length):
    return np.linalg.norm(x[0] - np.array([1.0, 2.0, 3.0])) - length


LAWS = {
    "distance": (distance, 2, _distance, {"rest_length": 0.8}, {}),
    "angle": (angle, 3, _angle, {"rest_angle": 1.1}, {}),
    "volume": (volume, 4, _volume, {"rest_volume": 0.3}, {}),
    "reach": (reach, 1, _reach, {"length": 1.7}, {"anchor": (1, 2, 3)}),
}


def simulate(scene, device="cpu", **knobs):
    """One substep a frame, unless told otherwise."""
    return ps.Simulation(scene, ps.Settings(**{"dt": 0.01, "substeps": 1, **knobs}), device=device)


def pair(*, x=((0, 0, 0), (1, 0, 0)), gravity=False, **particles):
    """A scene of two particles."""
    scene = ps.Scene()
    scene.add_particles(x, **particles)
    if gravity:
        scene.add_interaction(ps.UniformGravity((0, -9.81, 0)))
    return scene


def cloth(n=6, seed=0):
    """Positions and pairs of a small square cloth with diagonals, pulled about."""
    k = np.arange(n * n).reshape(n, n)
    ends = [(k[:-1], k[1:]), (k[:, :-1], k[:, 1:]), (k[:-1, :-1], k[1:, 1:])]
    pairs = np.concatenate([np.stack([a.ravel(), b.ravel()], axis=1) for a, b in ends])
    x = np.stack([k // n, 0 * k, k % n], axis=-1).reshape(-1, 3) * 0.1
    return x + np.random.default_rng(seed).normal(0, 0.02, x.shape), pairs


# Laws and their gradients ---------------------------------------------------------------------


@pytest.mark.parametrize("name", LAWS)
def test_projection_follows_the_gradient(name, precision, device):
    """dx_a = w_a grad_a C dlam, dlam = -C / sum w |grad C|^2, by central differences."""
    law, size, reference, parameters, fixed = LAWS[name]
    x = RNG.uniform(-1, 1, (size, 3))
    w = RNG.uniform(0.5, 2, size)
    scene = ps.Scene()
    scene.add_particles(x, mass=1 / w)
    scene.add_constraint(ps.Constraint(law, np.arange(size)[None], **parameters, **fixed))
    sim = simulate(scene, device, precision=precision)
    sim.project(1)
    step = 1e-6
    gradient = np.zeros((size, 3))
    for at in np.ndindex(size, 3):
        moved = np.zeros((size, 3))
        moved[at] = step
        gradient[at] = (
            reference(x + moved, *parameters.values()) - reference(x - moved, *parameters.values())
        ) / (2 * step)
    c = reference(x, *parameters.values())
    dx = -c * w[:, None] * gradient / (w[:, None] * gradient**2).sum()
    # Differences are exact to step^2 + 1e-16 / step; in float32 acos(c) loses 1e-7 / sin^2.
    assert np.allclose(sim.position - x, dx, rtol=0, atol=1e-8 if precision == "float64" else 1e-5)


def test_distance_is_its_law(device):
    """The gradient written by hand, for rods, springs with damping and inequalities."""
    x, pairs = cloth()
    found = []
    for make in (
        lambda **kw: ps.Distance(pairs, 0.1, **kw),
        lambda **kw: ps.Constraint(distance, pairs, rest_length=0.1, **kw),
    ):
        for options in (
            {},
            {"compliance": 1e-5, "damping": 10.0},
            {"inequality": True},
        ):
            scene = ps.Scene()
            scene.add_particles(x, pinned=np.arange(len(x)) < 2)
            scene.add_interaction(ps.UniformGravity())
            scene.add_constraint(make(**options))
            sim = simulate(scene, device, iterations=3, precision="float64")
            sim.run(5)
            found.append(sim.position)
    for a, b in zip(found[:3], found[3:], strict=True):
        assert np.allclose(a, b, rtol=0, atol=1e-13)


# The solve ------------------------------------------------------------------------------------


def gauss_seidel(x, v, w, pairs, length, alpha, beta, h, iterations, sign):
    """One XPBD substep of distances in NumPy, tuple after tuple in the order of the colours."""
    order = np.argsort(topology.colors(pairs), kind="stable")
    previous, x = x.copy(), x + h * v
    lam = np.zeros(len(pairs))
    for _ in range(iterations):
        for r in order:
            i, j = pairs[r]
            if w[i] + w[j] == 0:
                continue
            d = x[j] - x[i]
            n = d / np.linalg.norm(d)
            c = np.linalg.norm(d) - length[r]
            grad = np.stack([-n, n])
            if sign < 0:
                c, grad = -c, -grad
            soft, gamma = alpha[r] / h**2, alpha[r] * beta[r] / h
            way = (grad * (x[[i, j]] - previous[[i, j]])).sum()
            change = (-c - soft * lam[r] - gamma * way) / ((1 + gamma) * w[[i, j]].sum() + soft)
            if sign != 0:
                change = 0.0 if c >= 0 and lam[r] == 0 else max(change, -lam[r])
            lam[r] += change
            x[[i, j]] += w[[i, j], None] * grad * change
    return x, (x - previous) / h, lam


@pytest.mark.parametrize("kind", ["rod", "strut", "rope"])
def test_solve_equals_gauss_seidel_in_order(kind, precision, device):
    """Coloured sweeps against NumPy's, with compliance, damping, masses and pinned particles."""
    x, pairs = cloth()
    m = len(pairs)
    v = RNG.normal(0, 0.1, x.shape)
    w = RNG.uniform(0.5, 2, len(x)) * (np.arange(len(x)) > 1)
    length = RNG.uniform(0.08, 0.12, m)
    alpha, beta = RNG.uniform(0, 1e-4, m), RNG.uniform(0, 5, m)
    h, iterations = 0.01, 4
    scene = ps.Scene()
    v[w == 0] = 0
    scene.add_particles(x, velocity=v, mass=1 / np.where(w > 0, w, 1), pinned=w == 0)
    options = {"strut": {"inequality": True}, "rope": {"tension_only": True}, "rod": {}}[kind]
    rods = scene.add_constraint(
        ps.Distance(pairs, length, compliance=alpha, damping=beta, **options)
    )
    sim = simulate(scene, device, dt=h, iterations=iterations, precision=precision)
    sign = {"rod": 0, "strut": 1, "rope": -1}[kind]
    for _ in range(3):
        sim.step()
        x, v, lam = gauss_seidel(x, v, w, pairs, length, alpha, beta, h, iterations, sign)
    tolerance = 1e-12 if precision == "float64" else 2e-6  # some tens of last bits of lengths of 1
    assert np.allclose(sim.position, x, rtol=0, atol=tolerance)
    assert np.allclose(sim.velocity, v, rtol=0, atol=tolerance / h)
    assert np.allclose(sim.force(rods), np.abs(lam) / h**2, rtol=1e-3, atol=10 * tolerance / h**2)


def test_inequality_pushes_only(device):
    """C >= 0 is left alone while it holds, and no tuple pulls."""
    scene = ps.Scene()
    scene.add_particles([(0, 0, 0), (0.5, 0, 0), (0, 1, 0), (1.5, 1, 0)])
    scene.add_constraint(
        ps.Constraint(distance, [(0, 1), (2, 3)], rest_length=1.0, inequality=True)
    )
    sim = simulate(scene, device, precision="float64")
    sim.project(3)
    assert np.allclose(sim.position[:, 0], [-0.25, 0.75, 0, 1.5], atol=1e-15)


def test_rope_pulls_only(device):
    """The counterpart, tension_only."""
    scene = ps.Scene()
    scene.add_particles([(0, 0, 0), (0.5, 0, 0), (0, 1, 0), (1.5, 1, 0)])
    scene.add_constraint(ps.Distance([(0, 1), (2, 3)], 1.0, tension_only=True))
    sim = simulate(scene, device, precision="float64")
    sim.project(3)
    assert np.allclose(sim.position[:, 0], [0, 0.5, 0.25, 1.25], atol=1e-15)


def test_damping_is_a_damper(device):
    """A spring with a damper decays as exp(-beta t / (2 m)) in amplitude."""
    k, beta = 1000.0, 4.0
    scene = pair(x=[(0, 0, 0), (1.1, 0, 0)], pinned=[True, False])
    scene.add_constraint(ps.Distance([(0, 1)], 1.0, compliance=1 / k, damping=beta))
    sim = simulate(scene, device, dt=0.5, substeps=50_000, precision="float64")
    sim.step()
    stretch, v = sim.position[1, 0] - 1, sim.velocity[1, 0]
    energy = (v**2 + k * stretch**2) / (k * 0.1**2)
    # Over whole and half periods alike up to beta / (2 sqrt(k m)) = 6 %; the integrator's own
    # damping is k h t = 0.5 %.
    assert np.log(energy) == pytest.approx(-beta * 0.5, rel=0.05)


def test_momentum_is_conserved_to_rounding(precision, device):
    """Of a free cloth in violent motion."""
    x, pairs = cloth()
    v = RNG.normal(0, 1, x.shape)
    scene = ps.Scene()
    scene.add_particles(x, velocity=v, mass=RNG.uniform(0.5, 2, len(x)))
    scene.add_constraint(ps.Distance(pairs, 0.1))
    sim = simulate(scene, device, iterations=4, precision=precision)
    before = sim.diagnostics()
    sim.run(50)
    after = sim.diagnostics()
    # 50 substeps, each adding to 36 particles' velocities some 100 roundings of numbers near 1.
    tolerance = np.finfo(precision).eps * np.sqrt(50 * 36 * 100) * 2
    assert np.abs(after.momentum - before.momentum).max() < tolerance


def test_far_from_the_origin(device):
    """A pendulum 10 km away swings in float32 as at the origin: lengths do not lose digits."""

    def swing(shift, precision):
        scene = pair(x=np.array([(0, 0, 0), (1, 0, 0)]) + shift, pinned=[True, False], gravity=True)
        scene.add_constraint(ps.Distance([(0, 1)]))
        sim = simulate(scene, device, dt=1 / 60, substeps=100, precision=precision)
        sim.run(60)
        return sim.position[1] - shift, sim.velocity[1]

    (x, v), (x_far, v_far) = swing(0.0, "float64"), swing(1e4, "float32")
    assert np.abs(v_far - v).max() < 1e-2  # 6000 roundings of v, and of a length by 1e-7 over h
    assert np.abs(x_far - x).max() < 2e-3  # the last bit of 1e4 is 1e-3


def test_periodic_tuples_take_the_nearest_image(device, precision):
    """Across the faces of a periodic box, for the law and for the built-in alike."""
    for make in (
        lambda: ps.Distance([(0, 1)], 0.3),
        lambda: ps.Constraint(distance, [(0, 1)], rest_length=0.3),
    ):
        scene = ps.Scene(periodic=((0, 0, 0), (1, 1, 1)))
        scene.add_particles([(0.95, 0.5, 0.5), (0.05, 0.5, 0.5)])
        scene.add_constraint(make())
        sim = simulate(scene, device, precision=precision)
        sim.project(1)
        # From 0.1 apart to 0.3, each by 0.1.
        assert np.allclose(sim.position[:, 0], [0.85, 0.15], atol=1e-6)


def test_rest_length_from_the_start_is_across_faces(device):
    """None: the distances at the start, to the nearest image."""
    scene = ps.Scene(periodic=((0, 0, 0), (1, 1, 1)))
    scene.add_particles([(0.95, 0.5, 0.5), (0.05, 0.5, 0.5)], velocity=[(-1, 0, 0), (1, 0, 0)])
    scene.add_constraint(ps.Distance([(0, 1)]))
    sim = simulate(scene, device, precision="float64")
    sim.step()
    assert np.allclose(sim.position[:, 0], [0.95, 0.05], atol=1e-15)


def test_static_projection_gives_no_velocity(device):
    """sim.project moves the start onto the constraints, rigidly."""
    scene = pair(x=[(0, 0, 0), (2, 0, 0)])
    scene.add_constraint(ps.Distance([(0, 1)], 1.0, compliance=1.0))
    sim = simulate(scene, device, precision="float64")
    sim.project(1)
    assert np.allclose(sim.position[:, 0], [0.5, 1.5])
    sim.step()
    assert np.allclose(sim.velocity, 0)


# Breaking -------------------------------------------------------------------------------------


def test_what_breaks_stays_broken_until_the_reset(device):
    """A link that carries more than it can is gone; the others hold; a reset heals it."""
    scene = ps.Scene()
    x = np.stack([0 * np.arange(4.0), -np.arange(4.0), 0 * np.arange(4.0)], axis=1)
    scene.add_particles(x, mass=[1, 1, 1, 10.0], pinned=[True, False, False, False])
    scene.add_interaction(ps.UniformGravity((0, -10, 0)))
    limits = [1000.0, 105.0, 1000.0]  # the second link carries 110
    chain = scene.add_constraint(
        ps.Distance([(2, 3), (1, 2), (0, 1)], 1.0, compliance=1e-4, break_force=limits)
    )
    sim = simulate(scene, device, dt=0.01, substeps=10, precision="float64")
    sim.step()
    assert not sim.broken(chain).any()
    sim.run(100)
    assert sim.broken(chain).tolist() == [False, True, False]
    assert sim.position[1, 1] > -1.2  # holds
    assert sim.position[2, 1] < -4  # falls
    assert np.linalg.norm(sim.position[3] - sim.position[2]) == pytest.approx(1, abs=1e-2)
    assert "broken" in sim.constraints[0].persistent()
    sim.reset()
    assert not sim.broken(chain).any()
    assert np.allclose(sim.position, x)


def test_broken_are_restored_by_the_snapshot(device):
    """Going back to the start of a frame undoes what broke in it."""
    scene = pair(pinned=[True, False], velocity=[(0, 0, 0), (10, 0, 0)])
    rod = scene.add_constraint(ps.Distance([(0, 1)], 1.0, break_force=1.0))
    sim = simulate(scene, device)
    sim.step()
    assert sim.broken(rod).all()
    sim.frames.snapshot.restore()
    assert not sim.broken(rod).any()


def test_force_of_every_world(device):
    """Forces are listed in the order of the tuples, world by world, or by the scene's own."""
    scenes, springs = [], []
    for mass in (1.0, 2.0):
        scene = ps.Scene()
        scene.add_particles([(0, 0, 0), (0, -1, 0), (0, -2, 0)], mass=mass,
                            pinned=[True, False, False])  # fmt: skip
        scene.add_interaction(ps.UniformGravity((0, -10, 0)))
        springs.append(scene.add_constraint(ps.Distance([(1, 2), (0, 1)], 1.0, compliance=1e-3)))
        scenes.append(scene)
    sim = simulate(scenes, device, dt=1.0, substeps=50, precision="float64")
    sim.run(20)
    assert np.allclose(sim.constraints[0].force, [10, 20, 20, 40], rtol=1e-6)
    assert np.allclose(sim.force(springs[0]), [10, 20], rtol=1e-6)
    assert np.allclose(sim.force(springs[1]), [20, 40], rtol=1e-6)
    copies = simulate(scenes[0], device, dt=1.0, substeps=50, precision="float64")
    copies.run(20)
    assert copies.force(springs[0]).shape == (2,)


def test_force_needs_a_simulation():
    """What was never simulated cannot be read."""
    with pytest.raises(ValueError, match=r"write sim.force\(part\)"):
        _ = ps.Distance([(0, 1)]).force


# As a force -----------------------------------------------------------------------------------


def test_as_force_is_the_spring(precision, device):
    """Distance as a force equals Springs of stiffness 1 / alpha, and reports the same energy."""
    x, pairs = cloth()
    v = RNG.normal(0, 0.1, x.shape)
    found = []
    for interaction in (
        ps.Distance(pairs, 0.1, compliance=1e-3, damping=2.0).as_force(),
        ps.Springs(pairs, stiffness=1e3, rest_length=0.1, damping=2.0),
    ):
        scene = ps.Scene()
        scene.add_particles(x, velocity=v)
        scene.add_interaction(interaction)
        sim = simulate(scene, device, precision=precision)
        sim.forces(0.01)
        told = sim.diagnostics()
        found.append((sim.get("force"), told.potential, told.virial))
    # Relative rounding of a stretch of 0.02 out of 0.1, and of sums over six springs.
    relative = 100 * np.finfo(precision).eps
    for a, b in zip(*found, strict=True):
        assert np.allclose(a, b, rtol=0, atol=relative * np.abs(b).max())


@pytest.mark.parametrize("name", ["angle", "volume"])
def test_as_force_conserves_energy(name, device):
    """Forces of three- and four-particle laws are minus the gradient of the energy reported."""
    law, size, _, parameters, fixed = LAWS[name]
    scene = ps.Scene()
    x = [(0.6, 0, 0), (0, 0, 0), (0, 0.7, 0), (0, 0.1, 0.8)][:size]
    scene.add_particles(x, velocity=RNG.normal(0, 0.1, (size, 3)))
    force = ps.Constraint(
        law, np.arange(size)[None], compliance=0.1, **parameters, **fixed
    ).as_force()
    scene.add_interaction(force)
    drift = {}
    for substeps in (100, 200):
        sim = simulate(scene, device, dt=0.5, substeps=substeps, precision="float64",
                       integrator="velocity_verlet")  # fmt: skip
        start = sim.diagnostics().energy[0]
        sim.step()
        end = sim.diagnostics()
        drift[substeps] = abs(end.energy[0] - start)
        assert np.abs(end.momentum - sim.model.column("velocity").sum(axis=0)).max() < 1e-13
    assert start > 0.01
    assert drift[100] / drift[200] == pytest.approx(4, rel=0.1)  # second order, so conservative


def test_inequality_as_force_acts_below_zero(device):
    """One pair too near, one far: only the first is pushed."""
    scene = ps.Scene()
    scene.add_particles([(0, 0, 0), (0.5, 0, 0), (0, 1, 0), (1.5, 1, 0)])
    scene.add_interaction(
        ps.Distance([(0, 1), (2, 3)], 1.0, compliance=0.1, inequality=True).as_force()
    )
    sim = simulate(scene, device)
    sim.forces(0.01)
    assert np.allclose(sim.get("force")[:, 0], [-5, 5, 0, 0])


# Worlds and execution -------------------------------------------------------------------------


def hung_cloth(compliance, seed=0):
    """A cloth hung by two corners."""
    x, pairs = cloth(n=8, seed=seed)
    scene = ps.Scene()
    scene.add_particles(x, pinned=np.isin(np.arange(len(x)), (0, 7)))
    scene.add_interaction(ps.UniformGravity())
    scene.add_constraint(
        ps.Distance(pairs, 0.1, compliance=compliance, damping=5.0, break_force=400.0)
    )
    return scene


def test_a_world_in_a_batch_equals_it_alone(precision, device):
    """Bit for bit, with a compliance of its own in each world."""
    compliances = [0.0, 1e-6, 1e-4]
    knobs = {"dt": 1 / 60, "substeps": 8, "iterations": 2, "precision": precision}
    together = simulate([hung_cloth(c, seed=k) for k, c in enumerate(compliances)], device, **knobs)
    together.run(10)
    for k, c in enumerate(compliances):
        alone = simulate(hung_cloth(c, seed=k), device, **knobs)
        alone.run(10)
        assert np.array_equal(together.world(k).position, alone.position)
        assert np.array_equal(together.world(k).velocity, alone.velocity)


def test_reset_of_one_world_leaves_the_others(device):
    """The world that is reset goes as at first; the other goes on as if nothing had happened."""
    scenes = [hung_cloth(1e-6), hung_cloth(1e-4)]
    sim = simulate(scenes, device, dt=1 / 60, substeps=8)
    sim.run(5)
    first = sim.world(0).position
    untouched = simulate(scenes, device, dt=1 / 60, substeps=8)
    untouched.run(10)
    sim.reset([0])
    sim.run(5)
    assert np.array_equal(sim.world(0).position, first)
    assert np.array_equal(sim.world(1).position, untouched.world(1).position)


def test_graph_equals_threads():
    """Bit for bit, however a launch is cut; enough tuples for chunks."""
    x, pairs = cloth(n=60)
    found = []
    for knobs in ({"execution": "graph"}, {"execution": "threads", "threads": 3}):
        scene = ps.Scene()
        scene.add_particles(x, pinned=np.arange(len(x)) < 60)
        scene.add_interaction(ps.UniformGravity())
        scene.add_constraint(ps.Distance(pairs, 0.1, compliance=1e-7))
        sim = simulate(scene, dt=1 / 60, substeps=4, **knobs)
        sim.run(3)
        found.append((sim.position, sim.velocity))
        sim.close()
    assert np.array_equal(found[0], found[1])


def test_only_what_is_required(device):
    """No positions of the last substep, no pass for what cannot break."""
    sim = simulate(hung_cloth(1e-6), device)
    assert "previous_position" not in sim.state
    launches = [key for who, key, _ in sim.explain().launches if who == "Distance"]
    assert any("strain" in key for key in launches)
    scene = pair()
    scene.add_constraint(ps.Distance([(0, 1)]))
    launches = [key for who, key, _ in simulate(scene, device).explain().launches]
    assert not any("strain" in key for key in launches)


# Extremes -------------------------------------------------------------------------------------


@pytest.mark.parametrize("compliance", [0.0, 1e-12, 1e12])
@pytest.mark.parametrize("ratio", [1.0, 1e4, 1e-4])
def test_extreme_masses_and_compliances(compliance, ratio, precision, device):
    """A chain of ten thousandfold mass steps stays bounded and falls no faster than gravity."""
    scene = ps.Scene()
    x = np.stack([np.arange(5.0), 0 * np.arange(5.0), 0 * np.arange(5.0)], axis=1)
    mass = np.where(np.arange(5) % 2, ratio, 1.0)
    scene.add_particles(x, mass=mass, pinned=np.arange(5) == 0)
    scene.add_interaction(ps.UniformGravity((0, -10, 0)))
    scene.add_constraint(ps.Distance([(k, k + 1) for k in range(4)], compliance=compliance))
    sim = simulate(scene, device, dt=1 / 60, substeps=20, precision=precision)
    sim.run(60)
    energy = sim.diagnostics().energy[0] / mass.max()
    assert np.isfinite(sim.position).all()
    assert energy < 1e-3  # started at 0, and nothing adds to it


@pytest.mark.parametrize("gap", [0.0, 5e-9, 1e-30])
def test_coincident_ends_part(gap, precision, device):
    """Equally and opposite, to the rest length, whatever little is between them."""
    scene = pair(x=[(0, 0, 0), (gap, 0, 0)])
    scene.add_constraint(ps.Distance([(0, 1)], 1.0))
    sim = simulate(scene, device, precision=precision)
    sim.project(1)
    apart = sim.position[1] - sim.position[0]
    assert np.linalg.norm(apart) == pytest.approx(1, rel=1e-6)
    assert np.abs(sim.position.sum(axis=0)).max() < 1e-7
    sim.step()
    assert np.allclose(sim.velocity, 0, atol=1e-4)


def test_degenerate_tuples_stay(precision, device):
    """Of derived laws without a gradient: a length of nothing, angles of a folded triple."""
    scene = ps.Scene()
    scene.add_particles([(0, 0, 0), (0, 0, 0), (1, 0, 0), (1, 0, 0), (1, 0, 0)])
    scene.add_constraint(ps.Constraint(distance, [(0, 1)], rest_length=1.0))
    scene.add_constraint(ps.Constraint(angle, [(2, 3, 4)], rest_angle=1.0))
    scene.add_constraint(ps.Constraint(volume, [(0, 1, 2, 3)], rest_volume=1.0))
    sim = simulate(scene, device, precision=precision)
    sim.run(3)
    assert np.allclose(sim.position[:, 0], [0, 0, 1, 1, 1])


def test_all_pinned_and_empty(device):
    """Nothing to move, and nothing at all."""
    scene = pair(pinned=True)
    scene.add_constraint(ps.Distance([(0, 1)], 3.0))
    empty = scene.add_constraint(ps.Distance(np.zeros((0, 2), int), break_force=1.0))
    sim = simulate(scene, device)
    sim.run(2)
    assert np.allclose(sim.position, [(0, 0, 0), (1, 0, 0)])
    assert sim.force(empty).shape == sim.broken(empty).shape == (0,)


def test_no_time_passes(device):
    """A substep of nothing changes nothing."""
    scene = pair()
    scene.add_constraint(ps.Distance([(0, 1)], 3.0, compliance=1e-3, break_force=1.0))
    sim = simulate(scene, device)
    sim.substep(0.0)
    assert np.allclose(sim.position, [(0, 0, 0), (1, 0, 0)])


# Arguments ------------------------------------------------------------------------------------


@ps.law
def no_position(length: float):
    """Not a constraint."""
    return length


@ps.law
def own_name(a: wp.vec3, b: wp.vec3, compliance: float):
    """Takes a name that every constraint has."""
    return wp.length(b - a) - compliance


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: ps.Distance([(0, 1, 2)]), r"Distance: pairs must have shape \(m, 2\) of indices"),
        (lambda: ps.Distance([(0, 0)]), "Distance: pairs.0. must name different particles"),
        (lambda: ps.Distance([(0, -1)]), "Distance: pairs must hold indices from 0 up"),
        (lambda: ps.Distance([(0, 1)], -1.0), "Distance: rest_length.0. must be at least 0"),
        (lambda: ps.Distance([(0, 1)], [1.0, 2.0]), "Distance: rest_length must have shape"),
        (lambda: ps.Distance([(0, 1)], np.nan), "Distance: rest_length.* must be finite"),
        (lambda: ps.Distance([(0, 1)], compliance=-1), "Distance: compliance.0. must be at least"),
        (lambda: ps.Distance([(0, 1)], damping=np.inf), "Distance: damping.* must be finite"),
        (lambda: ps.Distance([(0, 1)], break_force=0), r"Distance: break_force.0. must be above 0"),
        (
            lambda: ps.Distance([(0, 1)], inequality=True, tension_only=True),
            "Distance: tension_only must be False with inequality",
        ),
        (
            lambda: ps.Constraint(distance, [(0, 1)]),
            r"Constraint: rest_length must be given, as distance\(a, b, rest_length\) asks for it",
        ),
        (
            lambda: ps.Constraint(distance, [(0, 1, 2)], rest_length=1.0),
            r"Constraint: particles must have shape \(m, 2\) of indices",
        ),
        (
            lambda: ps.Constraint(no_position, [(0, 1)], length=1.0),
            r"Constraint: law must take positions \(wp.vec3\) first, got 'no_position'",
        ),
        (
            lambda: ps.Constraint(own_name, [(0, 1)], compliance=1.0),
            "Constraint: parameter compliance of own_name must have a name of its own",
        ),
        (
            lambda: ps.Constraint(reach, [0], anchor=(1, 2), length=1.0),
            "Constraint: anchor must have shape",
        ),
        (
            lambda: ps.Distance([(0, 1)]).as_force(),
            r"Distance.as_force: compliance.0. must be above 0, got 0.0; its force would be",
        ),
        (
            lambda: ps.Distance([(0, 1)], compliance=1.0, break_force=1.0).as_force(),
            "Distance.as_force: break_force must be None",
        ),
    ],
)
def test_bad_arguments(make, message):
    """Each in the house form."""
    with pytest.raises(ValueError, match=message):
        make()


def test_unknown_parameter():
    """Lists those that the law has."""
    with pytest.raises(TypeError, match="parameter of distance must be one of rest_length, got"):
        ps.Constraint(distance, [(0, 1)], rest_lenght=1.0)


def test_index_beyond_the_scene(device):
    """Found when the scene is known."""
    scene = pair()
    scene.add_constraint(ps.Distance([(0, 2)], 1.0))
    with pytest.raises(ValueError, match="Distance: particles must hold indices from 0 to 1, got"):
        simulate(scene, device)


def test_scenes_of_other_kinds_do_not_mix(device):
    """A rope is not a rod."""
    scenes = []
    for options in ({}, {"tension_only": True}):
        scene = pair()
        scene.add_constraint(ps.Distance([(0, 1)], **options))
        scenes.append(scene)
    with pytest.raises(ValueError, match="be of the kinds of scenes"):
        simulate(scenes, device)
