"""SPlisHSPlasH (Bender et al.), float32: its WCSPH in a box of boundary particles."""

import ctypes.util
import importlib.util
import itertools
import json
import os
import shutil
import sys
import tempfile
import threading
from pathlib import Path

import numpy as np
from work import water as w

from particlesim.accuracy.bench.case import Entry, Place, Running

RADIUS = w.SPACING / 2  # the support is four of them
GAMMA = 7.0
VISCOSITY = w.VISCOSITY * w.SMOOTHING_LENGTH * w.SOUND_SPEED / 10  # of alpha (Monaghan 2005, 4.10)
FACES = "1 2 4, 1 4 3, 5 7 8, 5 8 6, 1 5 6, 1 6 2, 3 4 8, 3 8 7, 1 3 7, 1 7 5, 2 6 8, 2 8 4"


class Water(Running):
    """A block is so many steps. The library runs by itself in a thread, and is held up between."""

    def __init__(self, place: Place, side: int, length: float, start: float, frames: int):
        self.steps, self.particles = frames * w.SETTINGS.substeps, side**3
        self.work = self.steps * self.particles
        if start:
            self.begin = w.flowing(side, length, start, place.threads)
        else:
            self.begin = w.places(side), np.zeros((side**3, 3))
        self.library = _library()
        self._folder = tempfile.TemporaryDirectory()
        _write(Path(self._folder.name), side, length)
        self.left, self._go, self._done = 1, threading.Event(), threading.Event()
        threading.Thread(target=self._run, daemon=True).start()
        self._done.wait()  # of a step, in which it makes itself ready
        for k, (x, v) in enumerate(zip(*self.begin, strict=True)):
            self.fluid.setPosition(k, x)
            self.fluid.setVelocity(k, v)

    def advance(self) -> None:
        self.left = self.steps
        self._done.clear()
        self._go.set()
        self._done.wait()

    def answers(self) -> dict[str, float]:
        return w.answers(np.array([self.fluid.getPosition(k) for k in range(self.particles)]))

    def _run(self) -> None:
        base = self.library.Exec.SimulatorBase()
        base.init(
            sceneFile=str(Path(self._folder.name, "scene.json")), useGui=False, useCache=False,
            initialPause=False, stopAt=1e9, outputDir=self._folder.name,
        )  # fmt: skip
        base.initSimulation()
        self.fluid = self.library.Simulation.getCurrent().getFluidModel(0)
        assert self.fluid.numActiveParticles() == self.particles
        base.setTimeStepCB(self._after_step)
        base.runSimulation()

    def _after_step(self) -> None:
        self.left -= 1
        if self.left == 0:
            self._go.clear()
            self._done.set()
            self._go.wait()


def _library():
    """The module; its wheel has a libGL that ends the process, so it gets the system's."""
    specification = importlib.util.find_spec("pysplishsplash")
    file = Path(specification.origin)
    copy = Path(tempfile.mkdtemp())
    shutil.copy(file, copy)
    (copy / "pysplishsplash.libs").mkdir()
    for bundled in (file.parent / "pysplishsplash.libs").iterdir():
        stem = bundled.name.partition("-")[0].removeprefix("lib")
        own = ctypes.util.find_library(stem) if "GL" in stem else None
        os.symlink(_path_of(own) if own else bundled, copy / "pysplishsplash.libs" / bundled.name)
    sys.path.insert(0, str(copy))
    import pysplishsplash

    return pysplishsplash


def _path_of(library: str) -> str:
    """Where the loader finds it."""
    ctypes.CDLL(library)
    maps = Path("/proc/self/maps").read_text().splitlines()
    stem = library.partition(".so")[0]
    return next(line.split()[-1] for line in maps if f"/{stem}.so" in line)


def _write(folder: Path, side: int, length: float) -> None:
    """The scene, and the box that holds it."""
    width = side * w.SPACING
    corners = itertools.product((-0.5, 0.5), repeat=3)
    mesh = "".join("v {} {} {}\n".format(*corner) for corner in corners)
    mesh += "".join(f"f {face.strip()}\n" for face in FACES.split(","))
    (folder / "box.obj").write_text(mesh)
    middle = [length * width / 2, width, width / 2]
    # Its walls are particles: half a spacing beyond the wall, as if the water went on.
    sides = [length * width + w.SPACING, 2 * width + w.SPACING, width + w.SPACING]
    scene = {
        "Configuration": {
            "particleRadius": RADIUS, "timeStepSize": w.STEP, "cflMethod": 0,
            "gravitation": [0, -w.GRAVITY, 0], "simulationMethod": 0, "kernel": 0,
            "gradKernel": 0, "boundaryHandlingMethod": 0, "exponent": GAMMA,
            "stiffness": 1000.0 * w.SOUND_SPEED**2 / GAMMA, "numberOfStepsPerRenderUpdate": 1,
        },
        "Materials": [
            {"id": "Fluid", "density0": 1000, "viscosityMethod": 1, "viscosity": VISCOSITY}
        ],
        "RigidBodies": [
            {
                "geometryFile": "box.obj", "translation": middle, "scale": sides,
                "isDynamic": False, "isWall": True, "mapInvert": True, "samplingMode": 1,
            }
        ],
        # It fills a block with a layer less than fit.
        "FluidBlocks": [
            {"id": "Fluid", "denseMode": 0, "start": [0, 0, 0], "end": [width + w.SPACING] * 3}
        ],
    }  # fmt: skip
    (folder / "scene.json").write_text(json.dumps(scene))


def water(side: int, length: float, start: float, frames: int) -> Entry:
    """The column."""
    return Entry(
        lambda place: Water(place, side, length, start, frames), "float32", "pysplishsplash"
    )
