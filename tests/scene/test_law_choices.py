"""Derivatives of laws that choose: those of the branch that is taken, and nothing of the other."""

import ast

import numpy as np
import pytest
import warp as wp

import particlesim as ps
from particlesim.engine.model import Model
from particlesim.kernels.choices import derivable


@ps.law
def direct(r: float, k: float):
    return wp.where(r < 1.0, k * wp.sqrt(1.0 - r), 0.0)


@ps.law
def other_way(r: float, k: float):
    return wp.where(r >= 1.0, 0.0, k * wp.sqrt(1.0 - r))


@ps.law
def by_if(r: float, k: float):
    return k * wp.sqrt(1.0 - r) if r < 1.0 else 0.0


@ps.law
def computed_before(r: float, k: float):
    inside = r < 1.0
    left = 1.0 - r
    root = wp.sqrt(left)
    scaled = k * root
    return wp.where(inside, scaled, 0.0)


@ps.law
def written_again(r: float, k: float):
    left = float(1.0)
    left = left - r
    return wp.where(not r > 1.0, k * wp.sqrt(left), 0.0)


@ps.law
def root_of(s: float):
    return wp.sqrt(s)


@ps.law
def by_helper(r: float, k: float):
    return wp.where(r < 1.0, k * root_of(1.0 - r), 0.0)


@ps.law
def nested(r: float, k: float):
    # Infinite at 1, and no number beyond; the inner one is beyond its own from 0.5 on.
    inner = wp.where(r < 0.5, wp.log(1.0 - 2.0 * r), 0.0)
    return wp.where(r < 1.0, k * wp.sqrt(1.0 - r) + 0.0 * inner, 0.0)


@ps.law
def divided(r: float, k: float):
    return wp.where(r < 1.0, k * (1.0 - r) / wp.pow(1.0 - r, 0.5), 0.0)


@ps.law
def of_both_branches(r: float, k: float):
    root = wp.sqrt(1.0 - r)
    again = root * k
    # Beyond 1 the root is none, and read all the same, in what nobody asks for.
    far = wp.where(r < 2.0, 0.0, root)
    return wp.where(r < 1.0, again, far)


@ps.law
def nested_of_one_branch(r: float, k: float):
    left = 1.0 - r
    root = wp.sqrt(left)
    deep = wp.log(1.0 - 2.0 * r)
    inner = wp.where(r < 0.5, deep + r * root, k * root)
    return wp.where(r < 1.0, inner, 0.0)


@ps.law
def beside_what_is_computed_before(r: float, k: float):
    # What a root that is none is multiplied with is read too.
    root = wp.sqrt(1.0 - r)
    return wp.where(r < 1.0, (k + r - r) * root, r - r)


@ps.law
def asked_of_what_is_computed_before(r: float, k: float):
    left = 1.0 - r
    root = k * wp.sqrt(left)
    return wp.where(left > 0.0, root, 0.0)


@pytest.fixture(params=[True, False], ids=["vectorised", "plain"])
def vectorised(request, monkeypatch):
    monkeypatch.setattr(Model, "vectorised", request.param)


LAWS = [
    direct, other_way, by_if, computed_before, written_again, by_helper, nested, divided,
    of_both_branches, nested_of_one_branch, beside_what_is_computed_before,
    asked_of_what_is_computed_before,
]  # fmt: skip


@pytest.mark.parametrize("law", LAWS, ids=lambda law: law.name)
def test_nothing_comes_of_the_other_branch(law, precision, vectorised):
    scene = ps.Scene()
    scene.add_particles([(0, 0, 0), (1.5, 0, 0), (8, 0, 0), (8.75, 0, 0)])
    scene.add_interaction(ps.PairPotential(law, cutoff=2.0, k=2.0))
    sim = ps.Simulation(scene, ps.Settings(precision=precision), device="cpu")
    sim.forces(0.0)
    # u = 2 sqrt(1 - r), -u' = 1 / sqrt(1 - r), in ten roundings; r = 0.75 is exact.
    expected = [0.0, 0.0, -2.0, 2.0]
    few = 10 * float(np.finfo(precision).eps)
    np.testing.assert_allclose(sim.get("force")[:, 0], expected, rtol=few, atol=0)
    assert sim.diagnostics().potential[0] == pytest.approx(1.0, rel=few)


def test_of_vectors(precision):
    @ps.law
    def dome(position: wp.vec3):
        height = wp.sqrt(1.0 - wp.dot(position, position))
        return wp.where(wp.length(position) < 1.0, height, 0.0)

    scene = ps.Scene()
    scene.add_particles([(2, 0, 0), (0.6, 0, 0)])
    scene.add_interaction(ps.ParticleForce(potential=dome))
    sim = ps.Simulation(scene, ps.Settings(precision=precision), device="cpu")
    sim.forces(0.0)
    expected = [[0, 0, 0], [0.6 / 0.8, 0, 0]]
    few = 10 * float(np.finfo(precision).eps)
    np.testing.assert_allclose(sim.get("force"), expected, rtol=few, atol=0)


def test_nothing_is_computed_twice():
    """What is computed before a choice, for one branch, stays so: it costs what it did."""
    source = """
def choice(r: float, epsilon: float):
    s2 = epsilon / (r * r)
    s6 = s2 * s2 * s2
    near = r < 2.0
    return wp.where(near, s6 * s6 - s6, 0.0)
"""
    tree = derivable(ast.parse(source), lambda node: ast.unparse(node) == "wp.where")
    assert ast.unparse(tree).count("/") == 1


def test_what_is_wild_where_it_is_asked_stays_so():
    """An infinite force is none that is hidden."""

    @ps.law
    def edge(r: float):
        return wp.where(r <= 1.0, wp.sqrt(1.0 - r), 0.0)

    scene = ps.Scene()
    scene.add_particles([(0, 0, 0), (1, 0, 0)])
    scene.add_interaction(ps.PairPotential(edge, cutoff=2.0))
    sim = ps.Simulation(scene, device="cpu")
    sim.forces(0.0)
    # Infinite, or where products are taken in another order no number: nothing passes for a force.
    assert not np.isfinite(sim.get("force")[:, 0]).any()


def test_lines_of_errors_are_found_behind_what_was_moved(refused):
    @ps.law
    def wrong(r: float):
        root = wp.sqrt(1.0 - r)
        chosen = wp.where(r < 1.0, root, 0.0)
        return 2 * chosen

    scene = ps.Scene()
    scene.add_particles([(0, 0, 0), (1, 0, 0)])
    scene.add_interaction(ps.PairPotential(wrong, cutoff=2.0))
    with refused(r"got 'return 2 \* chosen'"):
        ps.Simulation(scene, device="cpu")
