"""Boundaries from a law in scenes: worlds, restarts, readings, recordings, what is refused."""

import numpy as np
import pytest
import warp as wp
from pxr import Usd, UsdGeom

import particlesim as ps
from cases.worlds import equal_alone, goes_on_after_reset_and_save
from particlesim.instruments.residuals import residuals

G = 9.81


@ps.law
def torus(x: wp.vec3, ring: float, tube: float):
    return wp.length(wp.vec2(wp.length(wp.vec2(x[0], x[2])) - ring, x[1])) - tube


@ps.law
def lobed(x: wp.vec3, center: wp.vec3, lobes: int, depth: float = 0.1):
    """The inside of a vessel with lobes about y."""
    d = x - center
    across = d[0] * d[0] + d[2] * d[2]
    return 1.0 - wp.length(d) + depth * across * wp.sin(float(lobes) * wp.atan2(d[2], d[0]))


@ps.law
def waves(x: wp.vec3, height: float, number: float):
    """Above a wavy floor."""
    return x[1] - height * wp.sin(number * x[0])


@ps.law
def no_place(height: float):
    return height


@ps.law
def nothing():
    return 1.0


@ps.law
def own_name(x: wp.vec3, friction: float):
    return x[1] - friction


@ps.law
def endless(x: wp.vec3, count: int):
    d = x[1]
    for _ in range(count):
        d = d + 1.0
    return d


def stirred(k, scene_of):
    """Grains in a vessel that turns over a torus, of world k; in world 0 nothing moves."""
    rng = np.random.default_rng(k)
    n = 30 + k
    vessel = ps.Boundary(
        lobed, friction=0.2 * k, restitution=0.2 * k, angular_velocity=(0, 0.5 * k, 0.2 * k),
        pivot=(0, 0.1, 0), center=(0, 0.1 * k, 0), lobes=3 + k,
    )  # fmt: skip
    ring = ps.Boundary(torus, 0.3, 0.1 * k, velocity=(0.1 * k, 0, 0), ring=0.4, tube=0.1 + 0.05 * k)
    return scene_of(
        rng.uniform(-0.4, 0.4, (n, 3)), vessel, ring, gravity=True,
        radius=rng.uniform(0, 0.1, n), velocity=rng.normal(0, 2, (n, 3)),
    )  # fmt: skip


# Worlds, restarts, execution ----------------------------------------------------------------------


@pytest.mark.slow
@pytest.mark.parametrize("precision", ["float64", "float32"])
def test_a_world_in_a_batch_equals_it_alone(precision, device, simulate, scene_of):
    """Bit for bit, with parameters of its own."""
    knobs = {"dt": 1 / 60, "substeps": 4, "precision": precision}
    equal_alone(simulate, [stirred(k, scene_of) for k in range(3)], device, 40, **knobs)


@pytest.mark.slow
def test_reset_and_checkpoint(tmp_path, device, simulate, scene_of):
    """A world that is reset goes as at first; a run that was saved goes on, bit for bit."""
    scenes = [stirred(k, scene_of) for k in range(1, 3)]
    goes_on_after_reset_and_save(simulate, scenes, device, tmp_path / "half.npz")


def test_a_checkpoint_of_another_law_is_refused(tmp_path, device, simulate, scene_of, refused):
    """By the law's name and its parameters."""
    sim = simulate(scene_of([(0, 2, 0)], ps.Boundary(torus, ring=1.0, tube=0.1)), device)
    sim.save(tmp_path / "torus.npz")
    other = scene_of([(0, 2, 0)], ps.Boundary(waves, height=0.1, number=1.0))
    with pytest.raises(ValueError, match="constraints"):
        ps.Simulation.load(tmp_path / "torus.npz", other, device=device)


def test_graph_equals_threads(simulate, scene_of):
    """Bit for bit, however the launches are cut."""
    rng = np.random.default_rng(0)
    x, v = rng.uniform(-0.5, 0.5, (3000, 3)), rng.normal(0, 3, (3000, 3))
    found = []
    for knobs in ({"execution": "graph"}, {"execution": "threads", "threads": 3}):
        vessel = ps.Boundary(lobed, 0.3, 0.5, center=(0, 0, 0), lobes=5)
        sim = simulate(scene_of(x, vessel, velocity=v, radius=0.01), dt=1 / 60, **knobs)
        sim.run(5)
        found.append((sim.position, sim.velocity))
        sim.close()
    assert np.array_equal(found[0], found[1])


def test_laws_of_other_kinds_do_not_mix(device, simulate, scene_of):
    """A torus is no vessel."""
    boundaries = (
        ps.Boundary(torus, ring=1.0, tube=0.1), ps.Boundary(lobed, center=(0, 0, 0), lobes=3),
    )  # fmt: skip
    with pytest.raises(ValueError, match="be of the kinds of scenes"):
        simulate([scene_of([(0, 0, 0)], each) for each in boundaries], device)


def test_only_the_group_is_held(device, simulate, scene_of):
    """Others pass, and without particles there is nothing to do."""
    floor = ps.Boundary(waves, group=[0], height=0.0, number=1.0)
    sim = simulate(scene_of([(0, 1, 0), (1, 1, 0)], floor, gravity=True), device)
    sim.run(100)
    assert sim.position[0, 1] == pytest.approx(0, abs=1e-12)
    assert sim.position[1, 1] < -3
    simulate(scene_of(np.zeros((0, 3)), floor_of_all()), device).run(2)


def floor_of_all(**options):
    return ps.Boundary(waves, **{"height": 0.1, "number": 2 * np.pi, **options})


class Ring(ps.Boundary):
    """A boundary of one's own: its law, under a name."""

    def __init__(self, radius, **options):
        super().__init__(torus, ring=radius, tube=0.1 * radius, **options)


def test_a_class_of_ones_own(device, simulate, scene_of, refused):
    """Is called by its name."""
    sim = simulate(scene_of([(1, 0.2, 0)], Ring(1.0), radius=0.1, gravity=True), device)
    sim.run(10)
    assert sim.position[0] == pytest.approx([1, 0.2, 0], abs=1e-12)
    assert {who for who, _, _ in sim.explain().launches} >= {"Ring"}
    with refused("Ring: ring must be finite"):
        Ring(np.inf)


# Reading and drawing ------------------------------------------------------------------------------


def test_residuals_are_how_deep_particles_are(precision, device, simulate, scene_of):
    """Below the radius, along the normal."""
    ring = ps.Boundary(torus, ring=1.0, tube=0.2)
    x, radius = np.random.default_rng(0).uniform(-1.3, 1.3, (50, 3)), 0.15
    sim = simulate(scene_of(x, ring, radius=radius), device, precision=precision)
    values, worlds = residuals(sim.constraints[0], sim)
    expected = np.maximum(radius - ring.distance(x), 0)
    assert (expected > 0).sum() > 5
    assert np.allclose(values, expected, atol=10 * np.finfo(precision).eps)
    assert not worlds.any()


@pytest.mark.parametrize("inside", [False, True])
def test_a_drawn_surface_is_where_the_law_is_zero(inside):
    """To a cell's sagitta, facing the particles; clear where it contains them."""
    box = ((-1.5, -1.5, -1.5), (1.5, 1.5, 1.5))
    wall = ps.Boundary(lobed, drawn=box, center=(0, 0, 0), lobes=3)
    ring = ps.Boundary(torus, drawn=box, ring=1.0, tube=0.3, velocity=(1, 0, 0))
    boundary = wall if inside else ring
    (drawn,) = boundary.shapes()
    points, triangles = drawn["points"], drawn["triangles"]
    assert drawn["kind"] == "mesh"
    assert drawn["container"] == inside
    assert drawn["moving"] != inside
    cell = 3 / 64
    assert np.abs(boundary.distance(points)).max() < cell**2 / 0.3
    a, b, c = (points[triangles[:, k]] for k in range(3))
    normal = np.cross(b - a, c - a)
    size = np.linalg.norm(normal, axis=1)
    whole = size > 0.01 * cell**2
    ahead = (a + b + c)[whole] / 3 + 0.3 * cell * (normal / size[:, None])[whole]
    assert (boundary.distance(ahead) > 0).all()


def test_nothing_is_drawn_unless_asked_for():
    """And nothing where there is nothing."""
    assert ps.Boundary(torus, ring=1.0, tube=0.3).shapes() == []
    far = ((5, 5, 5), (6, 6, 6))
    assert ps.Boundary(torus, drawn=far, ring=1.0, tube=0.3).shapes() == []


def test_recordings_hold_the_surface(tmp_path, device, simulate, scene_of):
    """As a mesh that moves as the boundary does."""
    ring = ps.Boundary(torus, drawn=((-1.5, -0.5, -1.5), (1.5, 0.5, 1.5)), velocity=(0, 0.5, 0),
                       ring=1.0, tube=0.3)  # fmt: skip
    sim = simulate(scene_of([(0, 3, 0)], ring, radius=0.1), device)
    sim.run(2, record=tmp_path / "out.usda")
    stage = Usd.Stage.Open(str(tmp_path / "out.usda"))
    prim = stage.GetPrimAtPath("/World/env_0000/boundaries/Boundary")
    assert len(UsdGeom.Mesh(prim).GetPointsAttr().Get()) == len(ring.shapes()[0]["points"])
    world = UsdGeom.XformCache(2).GetLocalToWorldTransform(prim)
    assert world.ExtractTranslation()[1] == pytest.approx(0.5 * sim.time)


# Periodic scenes ----------------------------------------------------------------------------------


def test_a_law_with_the_period_of_the_scene(device, simulate):
    """A wavy floor goes on across the faces; one of another period is refused."""
    found = []
    for shift in (0.0, 0.5):
        scene = ps.Scene(periodic=((shift, None, 0), (2 + shift, None, 1)))
        x = [(0.2, 1, 0.5), (1.9, 1, 0.5)]
        scene.add_particles(x, velocity=(1.5, 0, 0), radius=0.05)
        scene.add_interaction(ps.UniformGravity((0, -G, 0)))
        scene.add_constraint(floor_of_all(restitution=0.5, number=np.pi))
        sim = simulate(scene, device)
        sim.run(100)
        found.append(sim.position)
    gap = found[0] - found[1]
    assert np.allclose(gap - 2 * np.round(gap / 2), 0, atol=1e-9)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"number": 3.0}, "Boundary: law waves must be the same one period on, 2 along x .length"),
        ({"number": np.pi, "angular_velocity": (0, 1, 0)}, "angular_velocity must be 0 in a peri"),
    ],
)
def test_other_periods_are_refused(options, message, device, simulate, refused):
    scene = ps.Scene(periodic=((0, None, 0), (2, None, 1)))
    scene.add_particles([(0.5, 0.5, 0.5)])
    scene.add_constraint(floor_of_all(**options))
    with refused(message):
        simulate(scene, device)


# Arguments ----------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (
            lambda: ps.Boundary(no_place, height=1.0),
            r"law must take a place \(wp.vec3\) first, got",
        ),
        (lambda: ps.Boundary(nothing), "law must take a place"),
        (
            lambda: ps.Boundary(torus, ring=1.0),
            r"Boundary: tube must be given, as torus\(x, ring, tube\) asks for it",
        ),
        (lambda: ps.Boundary(torus, ring=(1, 2, 3), tube=0.1), "ring must be a number"),
        (lambda: ps.Boundary(lobed, center=1.0, lobes=3), r"center must have shape \(3,\)"),
        (lambda: ps.Boundary(lobed, center=(0, 0, 0), lobes=1.5), "lobes must be a whole number"),
        (lambda: ps.Boundary(torus, ring=np.nan, tube=0.1), "ring must be finite"),
        (lambda: ps.Boundary(own_name, friction=1.0), "friction of own_name must have a name of"),
        (lambda: ps.Boundary(endless, count=3), "law endless must loop at most 16 rounds"),
        (lambda: floor_of_all(friction=-1), "friction must be at least 0, got -1"),
        (lambda: floor_of_all(restitution=2), "restitution must be at most 1, got 2"),
        (lambda: floor_of_all(velocity=(1, 2)), r"velocity must have shape \(3,"),
        (lambda: floor_of_all(pivot=(1, 2, np.inf)), "pivot.2. must be finite"),
        (lambda: floor_of_all(drawn=1.0), "drawn must be two corners"),
        (lambda: floor_of_all(drawn=((0, 0, 0), (1, 0, 1))), "drawn must have its upper corner"),
        (lambda: floor_of_all().distance([1, 2]), r"Boundary.distance: points must have shape \(n"),
    ],
)
def test_bad_arguments(make, message, refused):
    """Each in the house form."""
    with refused(message):
        make()


def test_what_the_law_does_not_know(refused):
    """Lists the parameters that it has, and refuses what is no law."""
    with refused("parameter of torus must be one of ring, tube, got 'rink'", TypeError):
        ps.Boundary(torus, rink=1.0, tube=0.1)
    with pytest.raises(TypeError, match="func must be a function"):
        ps.Boundary((0, 1, 0))
