"""Runs to be killed: a warm process that forks a child for each, so that a start takes no second.

Reads lines of JSON, ``{"path": ..., "frames": ..., "limit": ..., "options": {...}}``, from stdin,
and answers each with the child's process number, and with its exit status when it has ended.
Children record a simulation of :func:`swing`; with a limit, no file of theirs can be larger.
"""

import json
import os
import resource
import sys

import warp as wp

import particlesim as ps

SETTINGS = ps.Settings(dt=1 / 60, substeps=4, iterations=3, execution="graph")


def swing():
    """Ropes that swing, touch, lie down and break: with contacts, friction and broken links."""
    import numpy as np

    scene = ps.Scene()
    for k in range(6):
        x = np.stack([np.linspace(0, 1.5, 13), np.full(13, 0.5), np.full(13, 0.11 * k)], axis=1)
        rope = scene.add_particles(
            x, mass=1.0 + 0.1 * k, radius=0.05, pinned=np.arange(13) == 0, group=f"rope {k}"
        )
        pairs = np.stack([rope[:-1], rope[1:]], axis=1)
        scene.add_constraint(ps.Distance(pairs, compliance=1e-6, break_force=500.0))
    scene.add_interaction(ps.UniformGravity())
    scene.add_interaction(ps.Drag(0.1))
    scene.add_constraint(ps.Contact(friction=0.3))
    scene.add_constraint(ps.PlaneBoundary((0, 0, 0), (0, 1, 0), friction=0.5))
    return scene


def record(path, frames, **options):
    ps.Simulation(swing(), SETTINGS, device="cpu").run(frames, record=path, **options)


def child(order):
    if order["limit"]:
        resource.setrlimit(resource.RLIMIT_FSIZE, (order["limit"],) * 2)
    try:
        record(order["path"], order["frames"], **order["options"])
    except BaseException as error:
        print(error, file=sys.stderr)
        os._exit(1)
    os._exit(0)


def main():
    wp.config.log_level = wp.LOG_WARNING
    sim = ps.Simulation(swing(), SETTINGS, device="cpu")
    sim.run(2)  # loads every kernel; children start with them
    sim.close()
    print("ready", flush=True)
    for line in sys.stdin:
        order = json.loads(line)
        pid = os.fork()
        if pid == 0:
            child(order)
        print(pid, flush=True)
        print(os.waitstatus_to_exitcode(os.waitpid(pid, 0)[1]), flush=True)


if __name__ == "__main__":
    main()
