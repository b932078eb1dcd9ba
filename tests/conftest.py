"""Fixtures shared by all tests."""

import re
from contextlib import contextmanager

import pytest
import warp as wp

import particlesim as ps

wp.init()
DEVICES = ["cpu", *(["cuda:0"] if wp.is_cuda_available() else [])]


@pytest.fixture(params=DEVICES)
def device(request):
    """Every device there is: the CPU, and CUDA where present."""
    return request.param


@pytest.fixture(params=["float32", "float64"])
def precision(request):
    """Both precisions."""
    return request.param


@pytest.fixture
def refused():
    """A context in which bad input must raise an error of the house form that says ``match``."""

    @contextmanager
    def check(match="", kind=ValueError):
        with pytest.raises(kind) as caught:
            yield
        text = str(caught.value.args[0])
        assert re.fullmatch(r"\w[\w.]*: .+ must .+, got .*; .+\.", text, re.DOTALL), text
        assert re.search(match, text), text

    return check


@pytest.fixture
def liquid():
    """A function that makes a Lennard-Jones liquid of 4 n^3 atoms, as a scene."""

    def build(cells=4, density=0.8442, temperature=1.44, seed=0, **options):
        count = 4 * cells**3
        side = (count / density) ** (1 / 3)
        scene = ps.Scene(periodic=((0, 0, 0), (side, side, side)))
        scene.add_particles(
            ps.sample.lattice("fcc", (cells, cells, cells), side / cells),
            velocity=ps.sample.maxwell_boltzmann(count, temperature, 1.0, seed=seed),
        )
        scene.add_interaction(ps.LennardJones(**{"cutoff": 2.5, **options}))
        return scene

    return build
