"""Kinds of particles in one pair force, forces between two groups, pairs that are left out."""

from types import SimpleNamespace

import numpy as np
import pytest
import warp as wp

import particlesim as ps
from cases.worlds import equal_alone
from particlesim.engine.model import Model

SIDE, COUNT = 9.0, 512
SIGMA = np.array([[1.0, 0.8, 0.9], [0.8, 0.88, 0.7], [0.9, 0.7, 0.6]])
EPSILON = np.array([[1.0, 1.5, 0.3], [1.5, 0.5, 0.8], [0.3, 0.8, 2.0]])
CUTOFF = 2.3 * SIGMA


@ps.law
def soft(r: float, strength: float, reach: float):
    overlap = wp.max(1.0 - r / reach, 0.0)
    return strength * overlap * overlap


def liquid(part, kinds=3, seed=0, count=COUNT):
    """A jittered lattice whose particles are of kinds in turn; ``part`` of the groups."""
    rng = np.random.default_rng(seed)
    x = ps.sample.lattice("sc", (8, 8, 8), SIDE / 8) + rng.uniform(-0.15, 0.15, (512, 3))
    x = x[:count]
    scene = ps.Scene(periodic=((0, 0, 0), (SIDE,) * 3))
    groups = [
        scene.add_particles(x[k::kinds], velocity=rng.normal(0, 1, x[k::kinds].shape))
        for k in range(kinds)
    ]
    scene.add_interaction(part(groups))
    return scene


def simulate(scenes, device="cpu", **knobs):
    knobs = {"dt": 0.02, "substeps": 20, "precision": "float64", **knobs}
    return ps.Simulation(scenes, ps.Settings(**knobs), device=device)


def bonds(seed=1):
    """Some pairs, of which particles have up to three."""
    rng = np.random.default_rng(seed)
    pairs = np.concatenate([rng.permutation(COUNT).reshape(-1, 2) for _ in range(3)])
    return np.unique(np.sort(pairs, axis=1), axis=0)


def expected(sim, counted):
    """Forces, energy and virial by NumPy; ``counted`` of kinds (i, j)."""
    kind = np.concatenate([np.full(len(g), k) for k, g in enumerate(sim.scenes[0].groups)])
    i, j = kind[:, None], kind[None]
    d = sim.position[:, None] - sim.position
    d -= SIDE * np.round(d / SIDE)
    r2 = (d**2).sum(axis=2)
    np.fill_diagonal(r2, 1e9)
    s6 = (SIGMA[i, j] ** 2 / r2) ** 3
    on = (r2 < CUTOFF[i, j] ** 2) & counted(i, j)
    w = np.where(on, 24 * EPSILON[i, j] * (2 * s6**2 - s6) / r2, 0.0)
    u = np.where(on, 4 * EPSILON[i, j] * (s6**2 - s6), 0.0)
    terms = w[:, :, None] * d
    return SimpleNamespace(
        force=terms.sum(axis=1), size=np.abs(terms).sum(axis=(1, 2)).max(),
        energy=0.5 * u.sum(), virial=0.5 * np.where(on, w * r2, 0.0).sum(),
        sizes=0.5 * np.abs(u).sum(),
    )  # fmt: skip


def tables(count):
    return {
        "epsilon": EPSILON[:count, :count], "sigma": SIGMA[:count, :count],
        "cutoff": CUTOFF[:count, :count],
    }  # fmt: skip


def left_out(pairs):
    out = np.zeros((COUNT, COUNT), dtype=bool)
    out[pairs[:, 0], pairs[:, 1]] = out[pairs[:, 1], pairs[:, 0]] = True
    return out


CASES = {
    "kinds": (3, lambda g: ps.LennardJones(g, **tables(3)), lambda i, j: np.True_),
    "two groups": (
        2,
        lambda g: ps.LennardJones(groups=(g[0], g[1]), **tables(2)),
        lambda i, j: i != j,
    ),
    "left out": (
        3,
        lambda g: ps.LennardJones(g, exclude=bonds(), **tables(3)),
        lambda i, j: ~left_out(bonds()),
    ),
}


@pytest.mark.parametrize("precision", ["float64", pytest.param("float32", marks=pytest.mark.slow)])
@pytest.mark.parametrize("case", CASES)
@pytest.mark.parametrize("loops", ["vectorised", "plain"])
def test_forces_are_those_of_the_kinds(case, loops, precision, device, monkeypatch):
    """A sum of some hundred terms, each of some ten operations, after rows were made anew."""
    monkeypatch.setattr(Model, "vectorised", loops == "vectorised" and device == "cpu")
    kinds, part, counted = CASES[case]
    sim = simulate(liquid(part, kinds), device, precision=precision, dt=0.004)
    sim.run(3)
    sim.forces(0.0)
    want, found = expected(sim, counted), sim.diagnostics()
    eps = np.finfo(precision).eps
    # A place is rounded to its last bit, which a steep force takes for 13 / r times as much.
    off = 100 * eps * want.size
    np.testing.assert_allclose(sim.get("force"), want.force, rtol=0, atol=off)
    assert found.potential[0] == pytest.approx(want.energy, abs=100 * eps * want.sizes)
    assert found.virial[0] == pytest.approx(want.virial, abs=1000 * eps * want.sizes)


def test_forces_of_a_user_go_by_kinds_too():
    """Of three pairs of kinds two feel each other; the same by forces that are apart."""
    strength = np.array([[0.0, 3.0], [3.0, 5.0]])
    at_once = simulate(
        liquid(lambda g: ps.PairPotential(soft, g, cutoff=1.5, strength=strength, reach=1.5), 2)
    )

    def apart(g):
        return ps.PairPotential(soft, groups=(g[0], g[1]), cutoff=1.5, strength=3.0, reach=1.5)

    scene = liquid(apart, 2)
    within = ps.PairPotential(soft, scene.groups[1], cutoff=1.5, strength=5.0, reach=1.5)
    scene.add_interaction(within)
    split = simulate(scene)
    f = at_once.get("force")
    np.testing.assert_allclose(f, split.get("force"), rtol=0, atol=1e-13 * np.abs(f).max())


def test_kinds_are_mixed():
    """Lorentz and Berthelot: the mean of the lengths, the root of the energies."""
    by_rule = ps.LennardJones(["a", "b"], epsilon=[1.0, 0.25], sigma=[1.0, 0.8])
    np.testing.assert_allclose(by_rule.sigma, [[1.0, 0.9], [0.9, 0.8]])
    np.testing.assert_allclose(by_rule.epsilon, [[1.0, 0.5], [0.5, 0.25]])
    roots = ps.LennardJones(["a", "b"], sigma=[1.0, 0.64], mixing="geometric")
    np.testing.assert_allclose(roots.sigma, [[1.0, 0.8], [0.8, 0.64]])


def test_a_world_goes_as_it_goes_alone(device):
    def part(g):
        pairs = np.column_stack([g[0].indices[:50], g[1].indices[:50]])
        return ps.LennardJones(g, exclude=pairs, **tables(3))

    scenes = [liquid(part, seed=k, count=count) for k, count in enumerate([512, 300])]
    equal_alone(simulate, scenes, device, 3)


def test_what_holds_particles_together_is_left_out():
    """Springs between all neighbours: none of them feels the other."""

    def force(exclude):
        scene = ps.Scene()
        scene.add_particles([(0, 0, 0), (1, 0, 0), (2, 0, 0)])
        springs = ps.Springs([(0, 1), (1, 2)], stiffness=0.0)
        scene.add_interaction(springs)
        scene.add_interaction(ps.LennardJones(exclude=exclude(springs)))
        return simulate(scene).get("force")

    assert np.abs(force(lambda s: None)[1]).max() == 0  # by symmetry
    far = 24 * (2 * 2.0**-13 - 2.0**-7)
    np.testing.assert_allclose(force(lambda s: s)[:, 0], [-far, 0, far], rtol=1e-14)
    assert not force(lambda s: [s, np.array([(0, 2)])]).any()


@pytest.mark.parametrize(
    ("part", "message"),
    [
        (lambda g: ps.LennardJones(epsilon=EPSILON), "group must be a list of groups, one a kind"),
        (lambda g: ps.LennardJones(g, epsilon=EPSILON[:2, :2]), r"have shape \(3, 3\)"),
        (lambda g: ps.LennardJones(g, sigma=SIGMA + np.eye(3, k=1)), "sigma must be symmetric"),
        (lambda g: ps.LennardJones(g, epsilon=-EPSILON), "epsilon must be at least 0"),
        (lambda g: ps.LennardJones(g, groups=(g[0], g[1])), "groups must be two groups"),
        (lambda g: ps.LennardJones(groups=(g[0],)), "groups must be two groups"),
        (lambda g: ps.LennardJones(groups=(g[0], g[0])), "no particle in common"),
        (lambda g: ps.LennardJones(exclude=[(0, 1, 2)]), r"exclude must have shape \(m, 2\)"),
        (lambda g: ps.LennardJones(exclude=[(0, 900)]), "exclude must hold indices from 0 to 511"),
        (lambda g: ps.LennardJones(truncation="smooth"), "truncation must be one of"),
        (lambda g: ps.Yukawa(truncation="shift"), "cutoff must be given with truncation='shift'"),
        (lambda g: ps.Yukawa(screening=0.0), "screening must be above 0"),
        (lambda g: ps.Coulomb(damping=0.2), "damping must be 0 without a cutoff"),
        (lambda g: ps.SoftSphere(exponent=1.0), "exponent must be at least 1.5"),
        (lambda g: ps.Morse(depth=-1.0), "depth must be at least 0"),
    ],
)
def test_what_does_not_fit_is_refused(part, message):
    with pytest.raises(ValueError, match=message):
        simulate(liquid(part))


def test_laws_take_whole_numbers(precision):
    """Attributes that are whole, and loops whose rounds are known."""

    @ps.law
    def by_type(r: float, type_i: int, type_j: int, strength: float):
        total = float(0.0)
        for n in range(3):
            total += float(n) * r
        return wp.where(type_i == type_j, strength, 2.0 * strength) * total

    scene = ps.Scene()
    scene.add_particles([(0, 0, 0), (0.7, 0, 0), (0, 0.5, 0)], type=[0, 1, 1])
    scene.add_interaction(ps.PairPotential(by_type, cutoff=0.8, strength=3.0))
    sim = simulate(scene, precision=precision)
    np.testing.assert_allclose(sim.get("force")[0], [18.0, 18.0, 0.0], rtol=1e-6)
