"""What holds of every kind of tuples: exact momenta, and the same bits however it is run."""

import numpy as np
import pytest

import particlesim as ps
from cases.worlds import equal_alone, goes_on_after_reset_and_save, same

BOX, TETRAHEDRA = ps.sample.box_tetrahedra((0, 0, 0), (2, 1, 1), 1.0)
CENTRE = (1.0, 0.5, 0.5)
FACES = TETRAHEDRA[:, :3]
HINGES = np.unique(np.concatenate([TETRAHEDRA, np.roll(TETRAHEDRA, 1, axis=1)]), axis=0)
# Each at first off its rest, and damped.
SOFT = {"compliance": 1e-2, "damping": 0.1}
KINDS = {
    "Angle": lambda: ps.Angle(FACES, 1.3, yield_angle=0.1, **SOFT),
    "Area": lambda: ps.Area(FACES, 0.55, **SOFT),
    "Bending": lambda: ps.Bending(HINGES, yield_angle=0.1, **SOFT),
    "Distance": lambda: ps.Distance(ps.sample.edges(FACES), 1.2, yield_strain=0.1, **SOFT),
    "IsometricBending": lambda: ps.IsometricBending(HINGES, **SOFT),
    "NeoHookean": lambda: ps.NeoHookean(TETRAHEDRA, 1e4, 0.3, damping=1e-3),
    "rigid NeoHookean": lambda: ps.NeoHookean(TETRAHEDRA, 1e10, 0.3),
    "Volume": lambda: ps.Volume(TETRAHEDRA, 0.2, **SOFT),
}


def thrown(kind, spin=(1.0, 2.0, 3.0)):
    """A body of this kind, which springs of a period of half a second keep from falling apart."""
    scene = ps.Scene()
    velocity = np.cross(spin, BOX - CENTRE) + np.array([5.0, 0, 0])
    scene.add_particles(BOX, velocity=velocity, mass=np.linspace(0.5, 1.5, len(BOX)))
    scene.add_constraint(ps.Distance(ps.sample.edges(FACES), compliance=1e-2))
    scene.add_constraint(KINDS[kind]())
    return scene


@pytest.mark.slow
@pytest.mark.parametrize("solver", ["gauss_seidel", "jacobi"])
@pytest.mark.parametrize("kind", KINDS)
def test_a_thrown_body_keeps_its_momenta(kind, solver, device, simulate):
    """To round-off, half a turn of it in 1 s.

    An impulse D lam dt acts where its particles were as the substep began, and D has neither sum
    nor moment there but for rounding: eps |D| lam dt of each tuple, some ten operations each. Of
    1000 substeps, 2 passes and up to 60 tuples these add up as a random walk, and impulses are no
    larger than the momenta that they change: sqrt(1000 2 60) 10 eps = 3500 eps.
    """
    scene = thrown(kind)
    sim = simulate(scene, device, substeps=10, solver=solver)
    before = sim.diagnostics()
    sim.run(100)
    after, eps = sim.diagnostics(), np.finfo(np.float64).eps
    assert np.abs(sim.position - BOX - (5.0, 0, 0)).max() > 1.0  # it has turned
    # A flat hinge has no direction in which its sum grows.
    kept = ["momentum"] + ["angular_momentum"] * (kind != "IsometricBending")
    for name in kept:
        start, end = getattr(before, name), getattr(after, name)
        assert np.abs(end - start).max() < 3500 * eps * np.abs(start).max(), name


@pytest.mark.slow
@pytest.mark.parametrize("solver", ["gauss_seidel", "jacobi"])
@pytest.mark.parametrize("kind", KINDS)
def test_same_bits(kind, solver, device, simulate, tmp_path):
    """Of worlds in a batch or alone, threads or a graph, after a reset and from a checkpoint."""

    def run(scenes, device, **knobs):
        return simulate(scenes, device, substeps=4, solver=solver, **knobs)

    scenes = [thrown(kind), thrown(kind, spin=(-3.0, 1.0, 0.5))]
    graph = equal_alone(run, scenes, device, 20, execution="graph")
    goes_on_after_reset_and_save(run, scenes, device, tmp_path / "run.npz")
    for threads in (1, 2):
        shared = run(scenes, device, execution="threads", threads=threads)
        shared.run(20)
        same(shared, graph)
