"""Clusters that are none are refused."""

import pytest

import particlesim as ps


@pytest.mark.parametrize(("clusters", "match"), [
    ([[]], r"clusters\[0\] must hold at least 2"), ([[0, 1], [2]], r"clusters\[1\] must hold"),
    ([[0, 1, 0]], r"clusters\[0\] must name different particles, got 0"),
    ([[0, -1]], r"clusters\[0\] must hold indices from 0 up"), ([0, 1], "must hold lists"),
    ([[0.5, 1.0]], "must hold lists"),
])  # fmt: skip
def test_bad_clusters(clusters, match, refused):
    with refused(match):
        ps.ShapeMatching(clusters)


def test_more_bad_input(refused, simulate, scene_of):
    with refused("indices from 0 to 1"):
        simulate(scene_of([(0, 0, 0), (1, 0, 0)], ps.ShapeMatching([[0, 2]])))
    with refused("compliance"):
        ps.ShapeMatching([[0, 1]], -1.0)
    with refused("rest must hold a shape for each of 1"):
        ps.ShapeMatching([[0, 1]], rest=[])
    with refused("break_force"):
        ps.ShapeMatching([[0, 1]], break_force=0.0)
    long = ps.Scene(periodic=((0, 0, 0), (1, 1, 1)))
    long.add_particles([(0.1, 0, 0), (0.5, 0.4, 0.4)])
    long.add_constraint(ps.ShapeMatching([[0, 1]]))
    with refused("half a periodic length"):
        simulate(long)
