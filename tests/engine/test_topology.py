"""Tuples of particles: checks, incidence and colours."""

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from particlesim.engine import topology


def test_tuples_are_checked(refused):
    assert topology.tuples("Owner", "pairs", [], 2).shape == (0, 2)
    assert topology.tuples("Owner", "pairs", [(0, 1), (5, 2)], 2).tolist() == [[0, 1], [5, 2]]
    assert topology.tuples("Owner", "each", [3, 4], 1).tolist() == [[3], [4]]
    for wrong, says in (
        ([(0, 1, 2)], r"shape \(m, 2\)"),
        ([0, 1], r"shape \(m, 2\)"),
        ([(0.0, 1.0)], "of indices"),
        ([(True, False)], "of indices"),
        ("ab", "of indices"),
        ([(0, -1)], "from 0 up, got -1"),
        ([(0, 1), (2, 2)], r"pairs\[1\] must name different particles, got \[2, 2\]"),
    ):
        with refused(says):
            topology.tuples("Owner", "pairs", wrong, 2)


def test_values_per_item(refused):
    np.testing.assert_array_equal(topology.per_item("O", "k", 2, 3, minimum=0), [2, 2, 2])
    with refused(r"k\[1\] must be at least 0, got -1.0"):
        topology.per_item("O", "k", [0, -1], 2, minimum=0)
    with refused(r"shape \(\) or \(2,\)"):
        topology.per_item("O", "k", [1, 2, 3], 2, minimum=0)


def lists_of_tuples(size):
    row = st.lists(st.integers(0, 20), min_size=size, max_size=size, unique=True)
    return st.lists(row, min_size=1, max_size=60).map(np.array)


pairs = lists_of_tuples(2)


@settings(deadline=None)
@given(st.integers(1, 4).flatmap(lists_of_tuples))
def test_incidence_lists_every_tuple_at_all_of_its_particles(index):
    rows = topology.incidence(index)
    found = []
    for k, particle in enumerate(rows["particle"]):
        begin, end = rows["begin"][k], rows["begin"][k + 1]
        own = rows["tuple"][begin:end]
        assert (np.diff(own) >= 0).all()  # in the order given: sums are the same every time
        found += [
            (int(particle), int(r), int(a))
            for r, a in zip(own, rows["seat"][begin:end], strict=True)
        ]
    expected = [(i, r, a) for r, ids in enumerate(index.tolist()) for a, i in enumerate(ids)]
    assert sorted(found) == sorted(expected)
    assert (np.diff(rows["particle"]) > 0).all()


@settings(deadline=None)
@given(pairs)
def test_tuples_of_a_colour_share_no_particle(index):
    color = topology.colors(index)
    for c in range(color.max() + 1):
        ends = index[color == c].ravel()
        assert len(ends) > 0
        assert len(set(ends.tolist())) == len(ends)
    # Greedy: a tuple meets fewer than two full sets of colours, one at each end.
    valence = np.bincount(index.ravel()).max()
    assert color.max() + 1 <= 2 * valence - 1


def test_a_chain_has_two_colours_and_a_lattice_few():
    chain = np.array([(k, k + 1) for k in range(50)])
    assert topology.colors(chain).max() == 1
    n = 12
    at = np.arange(n * n).reshape(n, n)
    grid = np.concatenate([
        np.stack([at[:, :-1].ravel(), at[:, 1:].ravel()], axis=1),
        np.stack([at[:-1].ravel(), at[1:].ravel()], axis=1),
    ])  # fmt: skip
    assert topology.colors(grid).max() + 1 <= 5


def test_colours_of_a_world_are_what_they_are_alone():
    one = np.array([(0, 1), (1, 2), (0, 2), (2, 3)])
    two = np.array([(0, 3), (3, 1), (1, 0)])
    together = topology.colors(np.concatenate([one, two + 4]))
    np.testing.assert_array_equal(together[:4], topology.colors(one))
    np.testing.assert_array_equal(together[4:], topology.colors(two))
