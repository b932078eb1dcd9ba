"""A writer of outputs, to be started twice: does at once what it is told, and says how it ended.

Reads lines of JSON, ``{"path": ..., "frames": ..., "options": {...}}``, and answers each with
another: who it is and what came of it. Runs last long enough to meet.
"""

import json
import os
import sys
import time

import warp as wp

import particlesim as ps


def main():
    wp.config.log_level = wp.LOG_WARNING
    scene = ps.Scene()
    scene.add_particles([(0, 0, 0), (1, 0, 0)], velocity=(1, 0, 0), radius=0.1)
    ps.Simulation(scene, device="cpu").run(1)
    print("ready", flush=True)
    for line in sys.stdin:
        order, told = json.loads(line), ""
        sim = ps.Simulation(scene, device="cpu")
        try:
            sim.run(
                order["frames"], record=order["path"], progress=lambda *_: time.sleep(0.1),
                **order["options"],
            )  # fmt: skip
        except OSError as error:
            told = f"{type(error).__name__}: {error}"
        print(json.dumps({"pid": os.getpid(), "error": told}), flush=True)


if __name__ == "__main__":
    main()
