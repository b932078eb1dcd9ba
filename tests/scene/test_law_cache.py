"""Laws and what is made of them have the same names in every process."""

import os
import subprocess
import sys

PROGRAM = """
import sys

import pytest
import warp as wp
import particlesim as ps

@ps.law
def yukawa(r: float, screening: float):
    return wp.exp(-r / screening) / r

@ps.law
def trap(position: wp.vec3):
    return -0.1 * position

@ps.law
def drag(mass_j: float, radius_j: float, velocity_j: wp.vec3) -> wp.vec3:
    return mass_j * radius_j * velocity_j

class Own(ps.Interaction):
    cutoff = 3.0

    def prepare(self, model, neighbors):
        self.sum = ps.PairSum(self, model, neighbors, drag)

    def apply(self, state, neighbors, dt):
        self.sum.add_to(state.force)

forces = [
    Own(),
    ps.LennardJones(cutoff=2.5),
    ps.PairPotential(yukawa, cutoff=1.0, screening=0.7),
    ps.Gravity(),
    ps.ParticleForce(trap),
    ps.Springs([(0, 1)], 1.0),
]
scene = ps.Scene()
scene.add_particles([(0, 0, 0), (1, 0, 0), (0, 1, 0)])
for force in forces[:: int(sys.argv[1])]:
    scene.add_interaction(force)
ps.Simulation(scene, device="cpu").step()
"""


@pytest.mark.slow
def test_kernels_are_found_in_the_cache_again(tmp_path):
    # The second process makes the same functions in the opposite order.
    program = tmp_path / "program.py"
    program.write_text(PROGRAM)
    cache = tmp_path / "cache"
    seen = []
    for order in ("1", "-1"):
        subprocess.run(
            [sys.executable, str(program), order],
            env={**os.environ, "WARP_CACHE_PATH": str(cache)}, check=True, timeout=200,
        )  # fmt: skip
        seen.append({path.relative_to(cache) for path in cache.rglob("*.o")})
    assert len(seen[0]) > 5
    assert seen[1] == seen[0]
