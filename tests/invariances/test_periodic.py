"""In a periodic box nothing depends on which image is given, nor on where its faces are."""

import numpy as np
import pytest

import particlesim as ps
from cases.frames import Frame
from cases.parts import COUNT, kinds, particles, scene
from particlesim.scene.part import Interaction

SIDE = 6.0  # the cluster is 1.4 long, the longest cutoff 2.1
SETTINGS = ps.Settings(dt=0.02, substeps=1, precision="float64", iterations=2)
EPS = float(np.finfo(np.float64).eps)
ROUNDING = 1e4 * EPS * SIDE  # as in test_frames.py, of places as large as the box
IMAGES = np.random.default_rng(3).integers(-2, 3, (COUNT, 3))
# They know places, which a box has images of, or a medium.
FIXED = {"ParticleForce", "ConstantForce", "UniformGravity", "Drag"}
TIED = {
    "Coulomb",
    "Springs",
    "Bonds",
    "HarmonicBonds",
    "Angles",
    "Distance",
    "Constraint",
    "ConstraintForce",
}  # act at any distance


def run(described, frames=12):
    """Unwrapped positions and velocities after some frames; skipped where a box is refused."""
    try:
        sim = ps.Simulation(described, SETTINGS, device="cpu")
    except ValueError as refusal:
        assert "periodic" in str(refusal) or "open" in str(refusal)
        pytest.skip(f"refused: {refusal}")
    for _ in range(frames):
        sim.step()
    return sim.position + SIDE * sim.get("image"), sim.velocity, sim


@pytest.mark.parametrize("name", kinds())
def test_by_box_vectors(name):
    """Each particle is given in another image: it stays there, and moves as it did."""
    x, v, _ = run(scene([name], box=SIDE))
    there, speed, sim = run(scene([name], box=SIDE, places=particles()[0] + SIDE * IMAGES))
    assert np.abs(x - particles()[0]).max() > 1e-3
    assert np.abs(there - SIDE * IMAGES - x).max() < 2 * ROUNDING
    assert np.abs(speed - v).max() < ROUNDING / SETTINGS.dt
    assert (np.abs(sim.position) <= 0.5 * SIDE).all()


@pytest.mark.parametrize("name", kinds())
@pytest.mark.parametrize("axes", [(1, 0, 0), (1, 1, 1)], ids=["a face", "a corner"])
def test_across_the_faces(name, axes):
    if name in FIXED:
        pytest.skip("it knows places, or takes no notice of a box")
    shift = 0.5 * SIDE * np.array(axes)
    x, v, _ = run(scene([name], box=SIDE))
    there, speed, sim = run(scene([name], Frame(shift=shift), box=SIDE))
    assert np.ptp(sim.position, axis=0)[0] > 0.8 * SIDE  # on both sides of the face
    assert np.abs(there - shift - x).max() < ROUNDING
    assert np.abs(speed - v).max() < ROUNDING / SETTINGS.dt


@pytest.mark.parametrize("name", sorted(TIED))
def test_ties_at_half_a_box(name):
    """On the corners of a cube of half the box everybody is as near on both sides of everybody."""
    corners = np.array([(i, j, k) for i in (0, 1) for j in (0, 1) for k in (0, 1)], dtype=float)
    described = scene([name], box=SIDE, places=0.5 * SIDE * corners)
    before = ps.Simulation(described, SETTINGS, device="cpu").diagnostics().momentum
    _, _, sim = run(described, frames=3)
    assert np.abs(sim.diagnostics().momentum - before).max() < ROUNDING
    if issubclass(kinds()[name], Interaction):
        again = ps.Simulation(described, SETTINGS, device="cpu")
        assert np.abs(again.get("force").sum(axis=0)).max() < ROUNDING
