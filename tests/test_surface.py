"""Surfaces: against shapes that are known, the definition in NumPy, and Warp's own dense grid."""

import sys

import numpy as np
import pytest
import warp as wp
from warp.geometry import IsoSurfaceMarchingCubes

import particlesim as ps
from particlesim.output.surface import marching
from particlesim.output.surface.marching import LEVEL_ISOTROPIC, SMOOTHED

RATIO = 1.3  # h over the spacing
SIGMA = 21 / (16 * np.pi)


def simulated(x, spacing=1.0, device="cpu", precision="float32", **knobs):
    scene = ps.Scene()
    scene.add_particles(x, radius=spacing / 2, group="drops")
    return ps.Simulation(scene, ps.Settings(precision=precision, **knobs), device=device)


def mesh_of(x, spacing=1.0, device="cpu", **options):
    return ps.Surface(simulated(x, spacing, device), **options).mesh()


def lattice(*cells, jitter=0.0, seed=0):
    """Unit cells with a particle each in the middle, or off it by up to ``jitter``."""
    x = np.stack(np.meshgrid(*map(np.arange, cells), indexing="ij"), -1).reshape(-1, 3) + 0.5
    return x + np.random.default_rng(seed).uniform(-jitter, jitter, x.shape)


def measures(points, triangles):
    """Volume by the divergence theorem, and area."""
    a, b, c = points[triangles].astype(float).swapaxes(0, 1)
    area = np.linalg.norm(np.cross(b - a, c - a), axis=1).sum() / 2
    return (a * np.cross(b, c)).sum() / 6, area


def directed_edges(triangles):
    return triangles[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2)


def assert_closed(triangles):
    """Every edge belongs to two triangles, which go along it in opposite directions."""
    edges = directed_edges(triangles)
    assert len(np.unique(edges, axis=0)) == len(edges)
    assert np.array_equal(np.unique(edges, axis=0), np.unique(edges[:, ::-1], axis=0))


def components(count, triangles):
    """Label of each point: the least point that it is connected to."""
    label, edges = np.arange(count), directed_edges(triangles)
    while True:
        before = label.copy()
        np.minimum.at(label, edges[:, 0], label[edges[:, 1]])
        label = label[label]
        if np.array_equal(label, before):
            return label


def weight(q):
    return np.maximum(1 - q / 2, 0) ** 4 * (1 + 2 * q)


# Known shapes


@pytest.mark.parametrize("anisotropic", [True, False])
def test_ball_converges(anisotropic, device):
    radius, center = 1.0, np.array([0.3, -2.0, 0.7])
    errors = []
    for d in (0.2, 0.1):
        x = ps.sample.sphere(center, radius, d)
        points, triangles, normals = mesh_of(x, d, device, anisotropic=anisotropic)
        assert points.dtype == normals.dtype == np.float32 and triangles.dtype == np.int32
        assert_closed(triangles)
        volume, area = measures(points - center, triangles)
        # The cells of the lattice points that are inside reach up to half their diagonal across
        # the sphere, and so may a point of the surface.
        out = points - center
        r = np.linalg.norm(out, axis=1)
        assert np.abs(r - radius).max() < np.sqrt(3) / 2 * d
        # The level puts flat faces right; what is left is of second order in d / R: 1/20 of a
        # spacing at d = R / 5 and R / 10, with terraces of one cell that tilt the surface by up to
        # 1/5 and add half of that squared to the area.
        assert volume == pytest.approx(4 / 3 * np.pi, rel=3 * 0.05 * d)
        assert area == pytest.approx(4 * np.pi, rel=2 * 0.05 * d + 0.2**2 / 2)
        errors.append(abs(volume / (len(x) * d**3) - 1))
        cosine = (normals * out).sum(axis=1) / r
        assert np.allclose(np.linalg.norm(normals, axis=1), 1.0, atol=1e-6)
        tilt = np.sqrt(np.mean(1 - cosine**2))
        assert cosine.min() > 0.8 and tilt < (0.12 if anisotropic else 0.25)
    # At half the spacing, half the difference from the particles' own volume.
    assert errors[1] < 0.7 * errors[0]


@pytest.mark.parametrize("smooth", [None, *SMOOTHED])
def test_flat_faces_are_flat_and_where_the_fluid_ends(smooth):
    options = {"anisotropic": False} if smooth is None else {"smooth": smooth}
    points, triangles, normals = mesh_of(lattice(13, 13, 7), spacing=1.0, **options)
    assert_closed(triangles)
    inner = (np.abs(points[:, :2] - 6.5) < 2.5).all(axis=1)
    for height, sign in ((0, -1), (7, 1)):
        face = inner & (np.abs(points[:, 2] - height) < 1)
        # The levels are given to three digits, and the field rises by one over less than a spacing.
        assert points[face, 2].mean() == pytest.approx(height, abs=0.02)
        # The lattice itself shows by the Fourier transform of the kernels at its period, under 1 %.
        assert points[face, 2].std() < 0.01
        assert (sign * normals[face, 2]).min() > 1 - 0.02**2


def test_anisotropic_kernels_smooth_a_rough_face():
    """On particles displaced at random by up to a quarter of the spacing."""
    x = lattice(20, 20, 6, jitter=0.25)

    def roughness(**options):
        points, _, normals = mesh_of(x, **options)
        face = (np.abs(points[:, :2] - 10) < 7).all(axis=1) & (points[:, 2] > 3)
        return np.sqrt((normals[face, :2] ** 2).sum(axis=1).mean()), points[face, 2].std()

    tilt, height = roughness(anisotropic=False)
    smoothed_tilt, smoothed_height = roughness()
    # Unevenness of several spacings is of the particles and stays; bumps of one should go.
    assert smoothed_tilt < 0.55 * tilt
    assert smoothed_height < 0.85 * height


def test_two_drops_far_apart():
    """Bricks are only where drops are: between these two a dense grid would have 10^10 nodes."""
    ball = ps.sample.sphere((0, 0, 0), 3.0, 1.0)
    far = np.array([2000.0, 300.0, -900.0])
    points, triangles, _ = mesh_of(np.concatenate([ball, ball + far]))
    assert_closed(triangles)
    label = components(len(points), triangles)
    assert len(np.unique(label)) == 2
    near = np.linalg.norm(points, axis=1) < 10
    volumes = [measures(points - at, triangles[near[triangles[:, 0]] == here])[0]
               for here, at in ((True, 0), (False, far))]  # fmt: skip
    # float32 at 2000 is 1e-4 of a spacing; the nodes lie otherwise, see the test of translation.
    assert volumes == pytest.approx([len(ball)] * 2, rel=0.05)
    assert volumes[0] == pytest.approx(volumes[1], rel=0.005)


def test_particle_on_its_own_is_a_drop_of_its_volume():
    surface = ps.Surface(simulated([(0.1, 0.2, 0.3)]), spacing=0.05)
    points, triangles, _ = surface.mesh()
    assert_closed(triangles)
    # Chords of a ball of radius 0.62 at edges of 0.05 cut off (0.05 / 0.62)^2 / 8 or so.
    assert measures(points, triangles)[0] == pytest.approx(1.0, rel=0.005)


@pytest.mark.parametrize("anisotropic", [True, False])
def test_translation_changes_little(anisotropic):
    x = ps.sample.sphere((0, 0, 0), 4.0, 1.0)
    volumes = [
        measures(*mesh_of(x + shift, anisotropic=anisotropic)[:2])[0]
        for shift in np.random.default_rng(0).uniform(-1, 1, (4, 3))
    ]
    # Points lie on the level wherever the nodes are; what changes is how chords of 0.5 cut off
    # curves of radius 4 and the terraces: (0.5 / 4)^2 / 8 of the radius, of the volume three times.
    assert np.ptp(volumes) < 0.006 * np.mean(volumes)


# The definition


def fluid(x, h=RATIO, precision="float64"):
    scene = ps.Scene()
    mass = np.random.default_rng(3).uniform(0.5, 1.5, len(x))
    water = scene.add_particles(x, mass=mass, group="water")
    sph = scene.add_interaction(
        ps.SPH(water, smoothing_length=h, rest_density=1.0, equation_of_state=ps.Tait(1.0))
    )
    return ps.Simulation(scene, ps.Settings(precision=precision), device="cpu"), sph


def test_isotropic_surface_is_the_level_of_the_colour_field(precision):
    """Against ``Simulation.interpolate``: the sum of m / rho W, and the gradient by differences."""
    x = lattice(6, 5, 4, jitter=0.3)
    sim, sph = fluid(x, precision=precision)
    surface = ps.Surface(sim, anisotropic=False)
    assert surface.smoothing_length == RATIO
    points, triangles, normals = surface.mesh()
    assert_closed(triangles)

    def color(where):
        return sim.interpolate(sph, where, np.ones(len(x)))

    # Four steps of Newton's or halving leave at most 1/16 of a spacing of 0.5, mostly far less;
    # the field's slope is below one.
    rest = np.abs(color(points) - LEVEL_ISOTROPIC)
    assert rest.max() < 0.5 / 16 and np.median(rest) < 1e-4
    step = 0.01
    gradient = np.stack(
        [(color(points + e) - color(points - e)) / (2 * step) for e in step * np.eye(3)], axis=1
    )
    expected = -gradient / np.linalg.norm(gradient, axis=1, keepdims=True)
    steep = np.linalg.norm(gradient, axis=1) > 0.1
    # Taken a step before the last point, and the differences' own error, step^2 W''' / W' / 6.
    assert steep.mean() > 0.99
    assert (normals * expected).sum(axis=1)[steep].min() > 0.99


def yu_and_turk(x, mass, h, p):
    """Centres, stretches and weights by the paper's equations, over all pairs."""
    d = (x[None] - x[:, None]) / h
    r = np.linalg.norm(d, axis=2)
    volume = mass / (mass * weight(r)).sum(axis=1)
    w = np.where(r < 2, 1 - (r / 2) ** 3, 0.0)
    total = w.sum(axis=1)
    mean = np.einsum("ij,ijk->ik", w, d) / total[:, None]
    apart = d - mean[:, None]
    covariance = np.einsum("ij,ija,ijb->iab", w, apart, apart) / total[:, None, None]
    lengths, axes = np.linalg.eigh(covariance / 0.6)
    lengths = np.clip(lengths, np.maximum(lengths.max(axis=1) * p.flattest, p.alone)[:, None], 1)
    alone = (r < 2).sum(axis=1) - 1 < p.fewest
    lengths[alone], mean[alone] = p.alone, 0
    stretch = np.einsum("iak,ik,ibk->iab", axes, 1 / lengths, axes)
    return x / h + p.smoothing * mean, stretch, volume / lengths.prod(axis=1)


def test_anisotropic_surface_is_the_level_of_the_field_of_yu_and_turk():
    x = np.concatenate([lattice(6, 5, 4, jitter=0.3), [(9, 9, 9), (9.5, 9, 9)]])
    sim, _ = fluid(x)
    surface = ps.Surface(sim, spacing=0.3)
    points = surface.mesh()[0].astype(float)
    shape = marching.Shape.anisotropic(0.5, None)
    center, stretch, weights = yu_and_turk(x, sim.get("mass"), RATIO, shape)
    d = points[:, None] / RATIO - center
    q = np.linalg.norm(np.einsum("jab,ijb->ija", stretch, d), axis=2)
    phi = (weights * weight(q)).sum(axis=1)
    # As above; kernels that are shorter than h by up to 1 / alone make the slope up to 4.
    assert np.abs(phi - shape.level).max() < 4 * 0.3 / 16
    assert np.median(np.abs(phi - shape.level)) < 0.01 * shape.level


def test_marching_equals_warps_dense_marching_cubes():
    """The same edges are crossed, and the same triangles lie between them."""
    x = np.concatenate([lattice(7, 5, 4, jitter=0.4), [(9.5, 6, 2), (10.3, 6.5, 2)]])
    sim, sph = fluid(x)
    spacing = 0.43
    points, triangles, _ = ps.Surface(sim, anisotropic=False, spacing=spacing).mesh()
    low, shape = -8, (48, 36, 32)
    nodes = (np.stack(np.meshgrid(*map(np.arange, shape), indexing="ij"), -1) + low) * spacing
    field = sim.interpolate(sph, nodes.reshape(-1, 3), np.ones(len(x))).reshape(shape)
    found, corners = IsoSurfaceMarchingCubes.extract(
        wp.array(field.astype(np.float32), dtype=float, device="cpu"), LEVEL_ISOTROPIC
    )

    def edge_of(place):
        """Twice the middle of the edge that a point lies on, in nodes, which names the edge."""
        rest = np.abs(place - np.round(place))
        axis = rest.argmax(axis=1)
        name = 2 * np.round(place).astype(int)
        rows = np.arange(len(place))
        name[rows, axis] = 2 * np.floor(place[rows, axis]).astype(int) + 1
        return name

    def named(place, triples):
        """Triangles as rows of edges' names, each from its least corner on."""
        names = edge_of(place)[triples]
        flat = (names @ (1 << 20, 1 << 10, 1)).astype(np.int64)
        first = flat.argmin(axis=1)
        turned = np.stack([flat[np.arange(len(flat)), (first + k) % 3] for k in range(3)], axis=1)
        return np.unique(turned, axis=0)

    own = named(points.astype(float) / spacing - low, triangles)
    dense = named(found.numpy().astype(float), corners.numpy().reshape(-1, 3)[:, ::-1])
    assert len(points) == len(found) and np.array_equal(own, dense)


# The same again


def test_bit_for_bit_whatever_the_threads():
    x = ps.sample.random((0, 0, 0), (8, 8, 4), 3000, seed=2)
    surfaces = [ps.Surface(simulated(x, 0.5, threads=threads)) for threads in (1, 1, 3)]
    meshes = [surface.mesh() for surface in surfaces] + [surfaces[0].mesh()]
    for other in meshes[1:]:
        assert all(np.array_equal(a, b) for a, b in zip(meshes[0], other, strict=True))


@pytest.mark.parametrize("anisotropic", [True, False])
def test_closed_and_without_empty_triangles_among_random_drops(anisotropic):
    for seed in range(3):
        x = ps.sample.random((0, 0, 0), (10, 10, 10), 400 + 200 * seed, seed=seed)
        points, triangles, _ = mesh_of(x, anisotropic=anisotropic)
        assert_closed(triangles)
        a, b, c = points[triangles].astype(float).swapaxes(0, 1)
        assert (np.linalg.norm(np.cross(b - a, c - a), axis=1) > 0).all()


def test_far_from_the_origin_in_float64():
    x = ps.sample.sphere((0, 0, 0), 3.0, 1.0)
    # A multiple of a brick of eight nodes at half a spacing, to 1e-10: the nodes lie alike.
    shift = 4.0 * np.array([25_000.0, 0.0, -5_000.0])
    meshes = [
        ps.Surface(simulated(x + at, precision="float64"), spacing=0.5).mesh() for at in (0, shift)
    ]
    assert np.array_equal(meshes[0][1], meshes[1][1])
    # Points are float32: 2^-8 at 1e5.
    assert np.allclose(meshes[1][0] - shift, meshes[0][0], atol=2**-8)
    assert np.allclose(meshes[1][2], meshes[0][2], atol=1e-4)


def test_closed_at_the_end_of_float32():
    """The farthest that is let through: places are rounded to a part of a spacing."""
    x, far = ps.sample.sphere((0, 0, 0), 3.0, 1.0), np.array([520_000.0, 520_000.0, 0.0])
    _, triangles, _ = mesh_of(np.concatenate([x, x + far]))
    assert_closed(triangles)


def test_nodes_stay_where_they_are():
    """A drop that appears elsewhere leaves the surface of the others as it was."""
    x = ps.sample.sphere((5, 5, 5), 3.0, 1.0)
    before = mesh_of(x, spacing=1.0)[0]
    after = mesh_of(np.concatenate([x, [(-9.3, 2.2, 1.1)]]), spacing=1.0)[0]
    both = after[np.linalg.norm(after - 5, axis=1) < 6]
    assert len(both) == len(before)
    # Places are rounded from another origin, 1e-6 or so.
    assert np.allclose(both, before, atol=1e-5)


# Whose surface


def test_groups_and_worlds():
    def build(radius):
        scene = ps.Scene()
        scene.add_particles(ps.sample.sphere((20, 0, 0), 2.0, 1.0), radius=0.5, group="stone")
        water = scene.add_particles(
            ps.sample.sphere((0, 0, 0), radius, 1.0), radius=0.1, group="water"
        )
        scene.add_interaction(
            ps.SPH(water, smoothing_length=RATIO, rest_density=1.0, equation_of_state=ps.Tait(9.0))
        )
        return scene

    scenes = [build(2.0), build(3.0)]
    sim = ps.Simulation(scenes, device="cpu")
    fluid_mesh = ps.Surface(sim, world=1).mesh()
    assert fluid_mesh[0][:, 0].max() < 10  # with SPH in the scene, None means the fluid
    for group in ("water", scenes[0]["water"], scenes[1]["water"], list(scenes[1]["water"])):
        assert np.array_equal(ps.Surface(sim, group, 1).mesh()[0], fluid_mesh[0])
    assert ps.Surface(sim, "stone").smoothing_length == pytest.approx(2.6 * 0.5)
    everything = ps.Surface(sim, [scenes[0]["water"], scenes[0]["stone"]]).mesh()[0]
    assert everything[:, 0].min() < -1 and everything[:, 0].max() > 21


def test_follows_the_simulation():
    sim = simulated(ps.sample.sphere((0, 0, 0), 3.0, 1.0))
    surface = ps.Surface(sim, spacing=0.5)
    before = surface.mesh()[0]
    shift = np.array([4.0, 0.0, 0.0])
    sim.position = sim.position + shift
    assert np.allclose(surface.mesh()[0], before + shift, atol=1e-5)


def test_no_particles():
    for x in (np.zeros((0, 3)), ps.sample.sphere((0, 0, 0), 2.0, 1.0)):
        sim = simulated(x)
        points, triangles, normals = ps.Surface(sim, []).mesh()
        assert points.shape == triangles.shape == normals.shape == (0, 3)
        assert triangles.dtype == np.int32 and points.dtype == normals.dtype == np.float32


def test_coincident_particles():
    points, triangles, _ = mesh_of(np.zeros((20, 3)))
    assert_closed(triangles)
    assert np.isfinite(points).all() and 0.1 < measures(points, triangles)[0] < 2


# Bad arguments


def test_bad_arguments(refused):
    sim = simulated(lattice(4, 4, 4))
    with refused("Surface: spacing must be above 0"):
        ps.Surface(sim, spacing=0.0)
    with refused("Surface: threshold must be above 0"):
        ps.Surface(sim, threshold=-1.0)
    with refused("Surface: smooth must be at most 1"):
        ps.Surface(sim, smooth=1.5)
    with refused("Surface: smoothing_length must be above 0"):
        ps.Surface(sim, smoothing_length=0.0)
    with refused("Surface: method must be one of"):
        ps.Surface(sim, method="dual_contouring")
    with refused("Simulation.world: index must be"):
        ps.Surface(sim, world=1)
    with refused("Surface: group must belong to the scene"):
        ps.Surface(sim, ps.Scene().add_particles([(0, 0, 0)]))
    with refused("Surface: smoothing_length must be given"):
        ps.Surface(simulated(lattice(2, 2, 2), spacing=0.0))


def test_positions_that_are_not_finite(refused):
    sim = simulated(lattice(4, 4, 4))
    surface = ps.Surface(sim)
    x = sim.position
    x[7, 1] = np.nan
    sim.state.position.assign(x)
    with refused("position must be finite.*particle 7 of world 0"):
        surface.mesh()


def test_too_many_nodes(refused):
    sim = simulated(np.concatenate([lattice(4, 4, 4), [(1e7, 0, 0)]]))
    with refused("spacing must be at least the fluid's extent over"):
        ps.Surface(sim).mesh()
    sim = simulated(lattice(4, 4, 4))
    for spacing in (1e-3, 1e-9):
        with refused("spacing must"):
            ps.Surface(sim, spacing=spacing).mesh()
    with refused("spacing must make at most 67108864 nodes.*use a coarser spacing"):
        ps.Surface(simulated([(0, 0, 0)]), spacing=1e-9).mesh()
    with refused("spacing must make at most 4000 nodes"):
        ps.Surface(sim, node_limit=4000).mesh()


# splashsurf


def test_splashsurf():
    pytest.importorskip("pysplashsurf")
    d, center = 0.1, np.array([3.0, 0.0, -1.0])
    x = ps.sample.sphere(center, 1.0, d)
    sim = simulated(x, d)
    for smoothed, shrinks in ((False, 0.05), (True, 0.15)):
        surface = ps.Surface(sim, method="splashsurf", anisotropic=smoothed)
        points, triangles, normals = surface.mesh()
        assert points.dtype == normals.dtype == np.float32 and triangles.dtype == np.int32
        assert_closed(triangles)
        # Its level is not made for the volume, and smoothing shrinks: half a spacing all round.
        assert measures(points - center, triangles)[0] == pytest.approx(4 / 3 * np.pi, rel=shrinks)
        cosine = (normals * (points - center)).sum(axis=1)
        assert (cosine / np.linalg.norm(points - center, axis=1)).min() > (
            0.95 if smoothed else 0.8
        )


def test_splashsurf_that_is_not_installed(monkeypatch, refused):
    monkeypatch.setitem(sys.modules, "pysplashsurf", None)
    with refused("method must be one that is installed", kind=ImportError):
        ps.Surface(simulated(lattice(2, 2, 2)), method="splashsurf")
