"""A unit force of one's own on every particle, written in all the ways that Python has."""

import numpy as np
import warp as wp

import particlesim as ps
from particlesim.engine.execution.executors import EagerExecutor

EXECUTIONS = ["graph", "threads", "eager"]
SUBSTEPS, FRAMES, DT = 5, 4, 0.1  # twenty substeps


@wp.kernel
def push32(f: wp.array(dtype=wp.vec3)):
    i = wp.tid()
    f[i] = f[i] + wp.vec3(1.0, 0.0, 0.0)


@wp.kernel
def push64(f: wp.array(dtype=wp.vec3d)):
    i = wp.tid()
    f[i] = f[i] + wp.vec3d(wp.float64(1.0), wp.float64(0.0), wp.float64(0.0))


@wp.kernel
def set_columns(f: wp.array2d(dtype=float)):
    i, j = wp.tid()
    if j == 0:
        f[i, j] = 1.0


@wp.kernel
def add_first(first: int, size: float, f: wp.array(dtype=wp.vec3)):
    i = first + wp.tid()
    f[i] = f[i] + wp.vec3(size, 0.0, 0.0)


def push(state, kernels=(push32, push64)):
    kernel = kernels[state.force.dtype is wp.vec3d]
    wp.launch(kernel, state.count, [state.force], device=state.force.device)


class Own(ps.Interaction):
    """A unit force along x on every particle, by ``way`` of writing it."""

    def __init__(self, way, **attributes):
        self.way = way
        vars(self).update(attributes)

    def prepare(self, model, neighbors): ...

    def attach(self, model, state):
        self.scratch = wp.zeros_like(state.force)

    def apply(self, state, neighbors, dt):
        self.way(self, state)


def launched(part, state):
    push(state)


def launched_with_keywords(part, state):
    kernel = push32 if state.force.dtype is wp.vec3 else push64
    wp.launch(kernel=kernel, dim=(state.count,), inputs=[], outputs=[state.force], device="cpu")


def copied(part, state):
    part.scratch.zero_()
    kernel = push32 if state.force.dtype is wp.vec3 else push64
    wp.launch(kernel, state.count, [part.scratch], device="cpu")
    wp.copy(state.force, part.scratch)


def filled(part, state):
    state.force.fill_((1.0, 0.0, 0.0))


def assigned(part, state):
    part.scratch.fill_((1.0, 0.0, 0.0))
    state.force.assign(part.scratch)


def made_on_the_way(part, state):
    scratch = wp.zeros_like(state.force)
    push(state, (push32, push64))
    wp.copy(scratch, state.force)
    wp.copy(state.force, scratch)


def in_numpy(part, state):
    force = state.force.numpy().copy()
    force[:, 0] += 1.0
    state.force.assign(force)


def by_view(part, state):
    np.asarray(state.force)[:, 0] += 1.0


def from_numpy(part, state):
    state.force.assign(np.array([(1.0, 0.0, 0.0)] * state.count))


def of_its_state(part, state):
    part.calls += 1
    if part.calls > 0:
        push(state)


def of_a_counter(part, state):
    part.calls += 1.0
    state.force.fill_((part.calls - part.calls + 1.0, 0.0, 0.0))


def at_random(part, state):
    state.force.fill_((1.0 + 0.0 * part.rng.normal(), 0.0, 0.0))


def kept_when_first_needed(part, state):
    if not hasattr(part, "late"):
        part.late = wp.zeros_like(state.force)
        part.late.fill_((1.0, 0.0, 0.0))
    wp.copy(state.force, part.late)


def with_a_command(part, state):
    kernel = push32 if state.force.dtype is wp.vec3 else push64
    wp.launch(kernel, state.count, [state.force], device="cpu", record_cmd=True).launch()


def strided(part, state):
    force = state.force
    real = wp.float32 if force.dtype is wp.vec3 else wp.float64
    wp.array(
        ptr=force.ptr, shape=(state.count,), strides=force.strides, dtype=real, device="cpu"
    ).fill_(1.0)


RECORDED = [launched, launched_with_keywords, copied, filled, assigned, made_on_the_way]
ON_HOST = [
    in_numpy, by_view, from_numpy, of_its_state, of_a_counter, at_random, with_a_command, strided,
]  # fmt: skip


def simulate(part, execution="graph", count=2, **knobs):
    scene = ps.Scene()
    scene.add_particles(np.arange(3.0 * count).reshape(count, 3) * [0, 1, 0])
    add = scene.add_constraint if isinstance(part, ps.ConstraintBase) else scene.add_interaction
    add(part)
    way = "graph" if execution == "eager" else execution
    settings = ps.Settings(dt=DT, substeps=SUBSTEPS, execution=way, threads=2, **knobs)
    sim = ps.Simulation(scene, settings, device="cpu")
    if execution == "eager":
        sim.executor.chosen = EagerExecutor(sim.executor.frame)
    return sim
