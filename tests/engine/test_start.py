"""Programs print what they print: Warp starts without a word, unless it is asked for one."""

import functools
import os
import subprocess
import sys
from pathlib import Path

import pytest

import particlesim

ROOT = Path(particlesim.__file__).parent.parent

RUN = """
import particlesim as ps
import warp as wp

@ps.law
def pull(r: float):
    return -r

scene = ps.Scene()
scene.add_particles([(0, 0, 0), (1, 0, 0)], radius=0.1)
scene.add_interaction(ps.PairForce(pull, cutoff=2.0))
sim = ps.Simulation(scene, device="cpu")
sim.run(2)
"""
DRAW = """
import particlesim as ps
from particlesim.pictures.render.geometry import Geometry
from particlesim.pictures.render.renderer import Renderer

geometry = Geometry()
geometry.add_spheres([(0, 0, 0)], 1.0, (1.0, 0.0, 0.0))
Renderer("cpu").draw(geometry, ps.Camera((0, 0, 10), (0, 0, 0)), 64, 36)
"""
ASKED = "import warp as wp; wp.config.log_level = wp.LOG_DEBUG\n"
LEVEL = "print('level', wp.config.log_level)\n"


@pytest.fixture
def said(tmp_path):
    """A function that tells what a program prints, both streams as one."""
    return functools.partial(_said, tmp_path / "program.py")


def _said(path, code, **environment):
    path.write_text(code)  # a law needs its source
    done = subprocess.run(
        [sys.executable, path], stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True,
        check=True, timeout=300, env={**os.environ, "PYTHONPATH": str(ROOT), **environment},
    )  # fmt: skip
    return done.stdout


@pytest.mark.parametrize("code", [RUN, DRAW])
def test_programs_print_nothing_of_warp(said, code):
    assert said(code) == ""


@pytest.mark.slow
def test_a_first_run_prints_nothing_of_what_it_compiles(said, tmp_path):
    assert said(DRAW, WARP_CACHE_PATH=str(tmp_path / "cache")) == ""


def test_warp_speaks_where_it_is_asked_to(said):
    shown = said(RUN + LEVEL, PARTICLESIM_VERBOSE="1")
    assert "Module" in shown and "level 20" in shown
    assert "level 10" in said(ASKED + RUN + LEVEL)
    assert "level 20" in said(RUN + "wp.config.log_level = wp.LOG_INFO; sim.run(1)\n" + LEVEL)


def test_warnings_are_still_shown(said):
    code = "from warp._src.logger import log_warning\nlog_warning('look here')\n"
    assert "look here" in said(RUN + code)
