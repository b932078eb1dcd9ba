"""What tests of the simulation share."""

import numpy as np

import particlesim as ps
from particlesim.scene.constraint_base import ConstraintBase


def drifting(count=3, **options):
    scene = ps.Scene()
    x = np.arange(3 * count).reshape(count, 3)
    scene.add_particles(x, velocity=(1, 0, 0), **options)
    return scene


class Holder(ConstraintBase):
    """A constraint that writes down when it is asked."""

    def __init__(self, label, calls):
        self.label, self.calls = label, calls

    def prepare(self, model, neighbors):
        self.calls.append(f"{self.label} prepare")

    def begin(self, state, neighbors, dt):
        self.calls.append(f"{self.label} begin {dt}")

    def project(self, state, neighbors, dt):
        self.calls.append(f"{self.label} project {dt}")

    def finish(self, state, neighbors, dt):
        self.calls.append(f"{self.label} finish {dt}")
