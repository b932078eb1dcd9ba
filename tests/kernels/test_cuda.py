"""Every kernel compiles for CUDA, also on a machine without one.

Simulations are built as they are for CUDA, with plain loops, but nothing is run: their kernels are
compiled to PTX, of all ready scenes and of others beside. What none of them launches fails.
"""

import ast
from pathlib import Path

import numpy as np
import pytest
import warp as wp

import particlesim as ps
from cases.every_kernel import EVERY_KERNEL, SCENES
from particlesim import kernels
from particlesim.engine.execution import launch
from particlesim.engine.model import Model
from particlesim.kernels.engine.bounces import bounces_type
from particlesim.kernels.precision import KERNELS
from particlesim.output.history.sample import sample
from particlesim.pictures.render import renderer  # noqa: F401 - its kernels are to be compiled too

ARCH = 90


@pytest.fixture
def launched(monkeypatch):
    """The kernels that simulations launch; they are noted and not run."""
    kernels = {}
    make = launch.Launch.__init__

    def note(self, kernel, *rest):
        kernels[kernel.module.name] = kernel
        make(self, kernel, *rest)

    monkeypatch.setattr(launch.Launch, "__init__", note)
    monkeypatch.setattr(launch.Launch, "issue", lambda self: None)
    monkeypatch.setattr(Model, "vectorised", False)
    return kernels


def simulate(name, precision):
    build, knobs = SCENES[name]
    sim = ps.Simulation(build(), ps.Settings(precision=precision, **knobs), device="cpu")
    sim.watchdog.resume(sim.frames, [0])  # as if its only world were frozen
    peak = sim.model.array(np.zeros(sim.particle_count), sim.model.precision.scalar)
    sim.frames._record(sim.settings.substeps, peak)
    sample(sim)
    if all(sim.model.periodic):
        ps.radial_distribution(sim)
    sim.project(1)
    sim.loop.frame = 1
    sim.rounds.make()
    sim.pace.look()
    for interaction in sim.interactions:
        if isinstance(interaction, ps.SPH):
            with np.errstate(invalid="ignore"):  # densities were not computed
                sim.interpolate(interaction, [(0, 0, 0)], "density")
                for what in ("gradient", "laplacian") if interaction.adaptive is None else ():
                    given = {"normalized": True, "derivative": what}
                    sim.interpolate(interaction, [(0, 0, 0)], "velocity", **given)
    for constraint in sim.constraints:
        with launch.record(launch.Program()):
            constraint.reset([0])
    bounces = bounces_type(sim.model.precision)()
    with launch.record(launch.Program()):
        for constraint in sim.constraints:
            for step in (constraint.start_bounce, constraint.prepare_bounce, constraint.bounce):
                step(sim.state, sim.neighbors, bounces, 0.01)
    return sim


def compile_for_cuda(kernel, folder):
    """Empty, or what is wrong."""
    try:
        wp.compile_aot_module(kernel.module, arch=ARCH, module_dir=folder, use_ptx=True)
    except Exception as error:
        return f"{kernel.key}: {error}"


def registered():
    """Names of all kernels in the sources, but those that are for the CPU only."""
    names = set()
    for path in Path(kernels.__file__).parent.rglob("*.py"):
        for node in ast.walk(ast.parse(path.read_text())):
            if isinstance(node, ast.FunctionDef):
                decorators = " ".join(map(ast.unparse, node.decorator_list))
                if "register" in decorators and "cpu_only=True" not in decorators:
                    names.add(node.name)
    return names


@pytest.mark.parametrize(
    ("precision", "names"),
    [
        ("float32", EVERY_KERNEL),
        pytest.param("float32", SCENES, marks=pytest.mark.slow),
        pytest.param("float64", EVERY_KERNEL, marks=pytest.mark.slow),
    ],
    ids=["float32", "float32, all variants", "float64"],
)
def test_every_kernel_compiles(precision, names, launched, tmp_path):
    # 0.15 s a kernel: one variant of each at least.
    for name in names:
        simulate(name, precision)
    # What draws is not part of a simulation; its kernels are made when their module is imported.
    drawing = {kernel.module.name: kernel for kernel in KERNELS if "__locals__" not in kernel.key}
    found = list((launched | drawing).values())
    misplaced = [kernel.key for kernel in found if kernel not in KERNELS]
    assert not misplaced, "these would be launched on CUDA, but are for the CPU only"
    first = {kernel.key.rpartition("__")[2]: kernel for kernel in reversed(found)}
    assert registered() - first.keys() == set()
    if names is not SCENES:  # one variant of each, as all take long
        found = list(first.values())
    # Threads would not help: each makes a precompiled header of its own.
    errors = [error for kernel in found if (error := compile_for_cuda(kernel, tmp_path))]
    assert not errors
    assert len(list(tmp_path.glob("*.ptx"))) == len(found) > 50
