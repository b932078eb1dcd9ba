"""NeoHookean: its energy, closed forms of one element, and finite elements of many."""

import numpy as np
import pytest

import particlesim as ps

RNG = np.random.default_rng(8)
CORNER = np.array([(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)], dtype=float)
E, NU = 1e4, 0.3
MU, LAMBDA = E / (2 * (1 + NU)), E * NU / ((1 + NU) * (1 - 2 * NU))


def bar(nx, ny, nz):
    """Unit cells of six tetrahedra each: positions and tetrahedra."""
    x = np.array([(i, j, k) for i in range(nx + 1) for j in range(ny + 1) for k in range(nz + 1)])
    k = np.arange(len(x)).reshape(nx + 1, ny + 1, nz + 1)
    corner = k[:-1, :-1, :-1].ravel()
    step = np.array([k[1, 0, 0], k[0, 1, 0], k[0, 0, 1]]) - k[0, 0, 0]
    tets = []
    for a, b, c in [(0, 1, 2), (1, 2, 0), (2, 0, 1), (0, 2, 1), (2, 1, 0), (1, 0, 2)]:
        way = [0, step[a], step[a] + step[b], step[a] + step[b] + step[c]]
        tets.append(np.stack([corner + each for each in way], axis=1))
    return x.astype(float), np.concatenate(tets)


def strain_energy(x, rest):
    """The law's energy of one tetrahedron in NumPy."""
    F = np.linalg.solve((rest[1:] - rest[0]), (x[1:] - x[0])).T
    J, V = np.linalg.det(F), abs(np.linalg.det(rest[1:] - rest[0])) / 6
    return V * (MU * ((F**2).sum() - 3) / 2 - MU * (J - 1) + (LAMBDA + MU) * (J - 1) ** 2 / 2)


@pytest.mark.slow
def test_gradient_and_energy(device, simulate):
    """Of both parts; the sum of their squares is the law's energy, inside out as well."""
    rest = RNG.normal(size=(6, 4, 3))
    tuples = np.arange(24).reshape(6, 4)
    start = rest.reshape(-1, 3)
    scene = ps.Scene()
    scene.add_particles(start)
    part = scene.add_constraint(ps.NeoHookean(tuples, E, NU))
    sim = simulate(scene, device)
    for x in (start + RNG.normal(0, 0.3, (24, 3)), start * (1, 1, -1), 0.1 * start):
        assert ps.check_gradient(part, x, start=start) < 1e-7  # steep where an element is thin
        sim.set("position", x)
        expected = [strain_energy(a, b) for a, b in zip(x.reshape(6, 4, 3), rest, strict=True)]
        assert sim.diagnostics().potential[0] == pytest.approx(sum(expected), rel=1e-12)


@pytest.mark.slow
@pytest.mark.parametrize("stretch", [1.001, 1.5, 2.0])
def test_a_pulled_cube_has_the_closed_form(stretch, device, simulate, precision):
    """Along s, with sides t = sqrt((1 + mu (s - 1) / ((lambda + mu) s)) / s) free of stress,

    P = mu (s - t^2) + (lambda + mu) (s t^2 - 1) t^2 per area at rest.
    """
    side = np.sqrt((1 + MU * (stretch - 1) / ((LAMBDA + MU) * stretch)) / stretch)
    pull = MU * (stretch - side**2) + (LAMBDA + MU) * (stretch * side**2 - 1) * side**2
    x, tets = bar(2, 2, 2)
    scene = ps.Scene()
    scene.add_particles(x, mass=0.5)
    scene.add_constraint(ps.NeoHookean(tets, E, NU))
    # A face's force goes to corners by a third of each of its triangles' areas.
    for end, sign in ((0, -1), (2, 1)):
        share = np.zeros(len(x))
        for tet in tets:
            face = tet[x[tet, 0] == end]
            if len(face) == 3:
                share[face] += 1 / 6
        assert share.sum() == pytest.approx(4)
        for a in np.flatnonzero(share):
            scene.add_interaction(ps.ConstantForce((sign * pull * share[a], 0, 0), [int(a)]))
    scene.add_interaction(ps.Drag(20.0))
    sim = simulate(scene, device, dt=0.02, substeps=20, iterations=4, precision=precision)
    sim.run(150)
    found = np.ptp(sim.position, axis=0) / 2
    assert found == pytest.approx([stretch, side, side], rel=2e-3)


def stiffness(x, tets):
    """Of linear elements for small displacements, in NumPy, (3 n, 3 n)."""
    K = np.zeros((len(x), 3, len(x), 3))
    for tet in tets:
        D = x[tet[1:]] - x[tet[0]]
        grad = np.linalg.inv(D).T
        grad = np.concatenate([-grad.sum(axis=0, keepdims=True), grad])
        V = abs(np.linalg.det(D)) / 6
        dots = grad @ grad.T
        for a in range(4):
            for b in range(4):
                K[tet[a], :, tet[b], :] += V * (
                    LAMBDA * np.outer(grad[a], grad[b])
                    + MU * np.outer(grad[b], grad[a])
                    + MU * dots[a, b] * np.eye(3)
                )
    return K.reshape(3 * len(x), -1)


@pytest.mark.slow
def test_a_cantilever_is_that_of_finite_elements(device, simulate):
    """The same mesh in NumPy, bent by 1e-3 of its length, where both are linear to 1e-3 of it.

    What is left is that of few iterations: 1e-4 with four, 1e-3 with one and as many substeps.

    It is far stiffer than a beam with this few elements across, which is what linear ones are.
    """
    x, tets = bar(6, 2, 2)
    held, load = x[:, 0] == 0, np.zeros(x.shape)
    load[x[:, 0] == 6, 1] = -E * 5e-6
    K = stiffness(x, tets)
    free = np.repeat(~held, 3)
    expected = np.zeros(3 * len(x))
    expected[free] = np.linalg.solve(K[np.ix_(free, free)], load.ravel()[free])
    expected = expected.reshape(-1, 3)
    scene = ps.Scene()
    body = scene.add_particles(x, mass=0.5, pinned=held)
    scene.add_constraint(ps.NeoHookean(tets, E, NU))
    scene.add_interaction(ps.ConstantForce((0, -E * 5e-6, 0), body[-9:]))
    scene.add_interaction(ps.Drag(2.0))
    for iterations, substeps, near in ((4, 20, 5e-4), (1, 80, 2e-3)):
        sim = simulate(scene, device, dt=0.05, substeps=substeps, iterations=iterations)
        sim.run(300)
        moved = sim.position - x
        assert moved[-9:, 1].mean() == pytest.approx(expected[-9:, 1].mean(), rel=near)


@pytest.mark.slow
@pytest.mark.parametrize("modulus", [1.0, 1e5, 1e12])
@pytest.mark.parametrize("nu", [0.0, 0.3, 0.5])
def test_rest_is_at_rest_at_any_stiffness(modulus, nu, device, simulate, precision):
    """Turned, in one iteration: nothing pulls against anything, not even by rounding's square root.

    Strains are good to some last bits, and a rigid element gives them to positions at once.
    """
    x, tets = bar(2, 2, 2)
    scene = ps.Scene()
    scene.add_particles(x)
    part = scene.add_constraint(ps.NeoHookean(tets, modulus, nu))
    sim = simulate(scene, device, precision=precision)
    turn, _ = np.linalg.qr(RNG.normal(size=(3, 3)))
    turn *= np.linalg.det(turn)
    sim.set("position", x @ turn.T)
    sim.run(20)
    eps = float(np.finfo(precision).eps)
    assert np.abs(sim.position - x @ turn.T).max() < 200 * eps
    assert sim.force(part).shape == (len(tets),)


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore")  # that such a start fits nothing is told
@pytest.mark.parametrize("start", ["flat", "inside out", "random"])
def test_it_comes_back(start, device, simulate, precision):
    """To its shape, from whatever was made of it, as Macklin and Mueller show."""
    x, tets = bar(2, 2, 2)
    rng = np.random.default_rng(2)
    spoiled = {
        "flat": x * (1, 1, 1e-3), "inside out": x * (1, 1, -1),
        "random": rng.uniform(0, 2, x.shape),
    }[start]  # fmt: skip
    scene = ps.Scene()
    scene.add_particles(x, mass=0.1)
    scene.add_constraint(ps.NeoHookean(tets, 1e3, 0.4, damping=0.02))
    scene.add_interaction(ps.Drag(1.0))
    sim = simulate(scene, device, dt=1 / 60, substeps=20, precision=precision, watchdog=False)
    sim.set("position", spoiled + rng.normal(0, 1e-2, x.shape))
    most = 0.0
    for _ in range(400):
        sim.step()
        most = max(most, np.abs(sim.position).max())
    edges = np.linalg.norm(sim.position[tets[:, 1:]] - sim.position[tets[:, :1]], axis=2)
    asked = np.linalg.norm(x[tets[:, 1:]] - x[tets[:, :1]], axis=2)
    volume = np.linalg.det(sim.position[tets[:, 1:]] - sim.position[tets[:, :1]])
    sign = np.sign(np.linalg.det(x[tets[:, 1:]] - x[tets[:, :1]]))
    assert np.abs(edges / asked - 1).max() < 1e-2
    assert (volume * sign > 0).all() and most < 20


@pytest.mark.slow
def test_bad_input(refused):
    scene = ps.Scene()
    scene.add_particles(CORNER * (1, 1, 0))
    scene.add_constraint(ps.NeoHookean([(0, 1, 2, 3)], E, NU))
    with refused("have a volume at the start"):
        ps.Simulation(scene)
    for given in ((0.0, 0.3), (1.0, 0.51), (1.0, -0.1)):
        with refused("must be"):
            ps.NeoHookean([(0, 1, 2, 3)], *given)
    with refused("name different particles"):
        ps.NeoHookean([(0, 1, 1, 3)], E, NU)
    with refused("hold each of its 1 different rows once"):
        ps.NeoHookean([(0, 1, 2, 3), (0, 1, 2, 3)], E, NU)
