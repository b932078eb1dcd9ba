"""Faults of parts: constraints not met, fluids that do not fit, laws that do not belong."""

from functools import partial

import numpy as np

import particlesim as ps

from . import laws
from .judge import (
    EULER,
    VERLET,
    Row,
    as_fine,
    energy_kept,
    momentum_kept,
    never,
    scene,
    slower_than,
    within,
)

# A table, laid out by hand.
# fmt: off

FRAME = {"dt": 1 / 60, "substeps": 10}
TWO = [(0, 0, 0), (1, 0, 0)]


def down():
    return ps.UniformGravity((0, -9.81, 0))


# Constraints -------------------------------------------------------------------------------------


def rope(links, ratio=1.0, **options):
    """Links of 0.1 that hang from a pin, the last mass ``ratio`` times the others."""
    x = [(0, -0.1 * k, 0) for k in range(links + 1)]
    mass = np.where(np.arange(links + 1) == links, 0.01 * ratio, 0.01)
    pairs = [(k, k + 1) for k in range(links)]
    return scene(x, down(), ps.Distance(pairs, 0.1, **options), mass=mass,
        pinned=np.arange(links + 1) == 0)


def length(links):
    """Off in length by parts of 2 %."""
    return lambda done: np.abs(done.x[:, -1, 1] / (0.1 * links) + 1).max() / 0.02


def of_constraints():
    for ratio in (1e2, 1e3, 1e4, 1e6):
        yield Row(f"10 rigid links under {ratio:g} times their mass", partial(rope, 10, ratio),
            length(10), 120, FRAME, names="Distance")
    yield Row("200 rigid links", partial(rope, 200), length(200), 120, FRAME, names="Distance")
    column = [(0, 0.05 + 0.1 * k, 0) for k in range(60)]
    yield Row("a column of 60 grains", partial(scene, column, down(), ps.Contact(),
        ps.PlaneBoundary((0, 0, 0), (0, 1, 0)), radius=0.05), lambda done: np.abs(done.x[-1, -1,
        1] / 5.95 - 1) / 0.02, 180, {"dt": 1 / 60, "substeps": 5}, names="Contact")
    yield Row("a heavy ball on light ones", partial(scene, [(0, 0.05, 0), (0, 0.15, 0), (0, 0.4,
        0)], down(), ps.Contact(), ps.PlaneBoundary((0, 0, 0), (0, 1, 0)), radius=[0.05, 0.05, 0.2],
        mass=[0.01, 0.01, 1e3]), lambda done: np.abs(done.x[-1, 2, 1] / 0.4 - 1) / 0.05, 120, FRAME,
        names="Contact")
    triangle = [(0, 0, 0), (1, 0, 0), (0, 1, 0)]
    yield Row("a triangle whose sides do not close", partial(scene, triangle, ps.Distance([(0, 1),
        (1, 2), (2, 0)], [1.0, 1.0, 3.0])), never, 30, FRAME, names="Distance")
    yield Row("a rod twice as long as its start", partial(scene, TWO, ps.Distance([(0, 1)], 2.0)),
        slower_than(1.0), 5, FRAME, names="Distance")
    yield Row("a rod between two pins of another distance", partial(scene, TWO, ps.Distance([(0,
        1)], 2.0), pinned=True), never, 10, FRAME, names="Distance")
    yield Row("a ball in a gap narrower than itself", partial(scene, [(0, 0.1, 0)],
        ps.PlaneBoundary((0, 0, 0), (0, 1, 0)), ps.PlaneBoundary((0, 0.2, 0), (0, -1, 0)),
        radius=0.3), never, 60, FRAME, names="PlaneBoundary")
    yield Row("a box full beyond what fits", partial(scene, np.random.default_rng(2).uniform(0.2,
        0.8, (60, 3)), ps.Contact(), ps.BoxBoundary((0, 0, 0), (1, 1, 1)), radius=0.2), never, 120,
        FRAME, names="Contact|BoxBoundary")
    yield Row("a square whose gradient vanishes", partial(scene, [(0, 0, 0), (0, 0, 0)],
        ps.Constraint(laws.squared_distance, [(0, 1)], rest=1.0)),
        lambda done: abs(np.linalg.norm(done.x[-1, 1] - done.x[-1, 0]) - 1) / 0.1, 30, FRAME,
        names="Constraint")
    yield Row("a rope that breaks at once", partial(rope, 10, 10.0, break_force=1e-6),
        lambda done: 0.0 if done.sim.broken(done.sim.constraints[0]).any() else np.inf, 5, FRAME)
    for beta in (1e3, 1e6):
        yield Row(f"a soft rope damped by {beta:g}", partial(rope, 5, compliance=1e-3,
            damping=beta), as_fine(32), 60, FRAME)


def of_speed():
    bullet = {"radius": 0.05, "velocity": [(0, 0, 0), (400, 0, 0)]}
    yield Row("a bullet that passes a ball in a substep", partial(scene, [(0, 0, 0), (-1, 0, 0)],
        ps.Contact(), **bullet), never, 2, FRAME, names="Contact")
    yield Row("a bullet that passes a ball later on", partial(scene, [(0, 0, 0), (-30, 0, 0)],
        ps.ConstantForce((2000, 0, 0)), ps.Contact(), radius=0.05, pinned=[True, False]), as_fine(),
        12, FRAME, names="Contact")
    yield Row("a ball that skips an obstacle", partial(scene, [(-1, 0.01, 0)], ps.SphereBoundary((0,
        0, 0), 0.2, inside=False), radius=0.01, velocity=(300, 0, 0)), never, 2, FRAME,
        names="SphereBoundary")
    yield Row("a ball against a wall at 1e5", partial(scene, [(0, 1, 0)], ps.PlaneBoundary((0, 0,
        0), (0, 1, 0), restitution=1.0), radius=0.1, velocity=(0, -1e5, 0)), slower_than(1e5, 1.1),
        10, FRAME)
    yield Row("a frame of 1000 s", partial(scene, [(0, 0.1, 0)], down(), ps.PlaneBoundary((0, 0, 0),
        (0, 1, 0)), radius=0.1), within(0.1, 1.1), 5, {"dt": 1000.0, "substeps": 1},
        names="PlaneBoundary|speed|beyond")


# Fluids ------------------------------------------------------------------------------------------


SPACING = 0.05


def water(mass=1.0, h=1.3, speed=20.0, rest=1000.0, count=6, velocity=(0, 0, 0), **options):
    x = ps.sample.box((0, 0, 0), (count * SPACING,) * 3, SPACING)
    fluid = ps.SPH(smoothing_length=h * SPACING, rest_density=rest,
        equation_of_state=ps.Tait(sound_speed=speed), **options)
    return scene(x, fluid, mass=mass * 1000 * SPACING**3, velocity=velocity)


def of_fluids():
    step = {"dt": 1 / 60, "substeps": 24}
    for factor in (1e-3, 0.1, 0.3, 2.0, 10.0, 1000.0):
        yield Row(f"water of {factor:g} times its mass", partial(water, factor), slower_than(0.5),
            6, step, names="SPH: mass")
    yield Row("water of density 1", partial(water, rest=1.0), never, 2, step, names="SPH: mass")
    for h in (0.4, 0.5, 0.7, 5.0):
        yield Row(f"water of h = {h} spacings", partial(water, h=h),
            lambda done: np.inf if done.row.knobs else 0, 4, {**step, "substeps": 100},
            names="SPH: (smoothing_length|mass)")
    for substeps in (1, 4, 10):
        yield Row(f"water in {substeps} substeps", partial(water, velocity=(0, 0, 0),
            viscosity=ps.ArtificialViscosity(0.1), speed=60.0), slower_than(0.5), 60, {"dt": 1 / 60,
            "substeps": substeps}, names="SPH|beyond")
    yield Row("water of a viscosity of 1000", partial(water,
        viscosity=ps.ArtificialViscosity(1000.0)), slower_than(0.5), 10, step, names="SPH")
    two = ps.sample.box((0, 0, 0), (0.3, 0.3, 0.3), SPACING)

    def colliding():
        made = ps.Scene()
        for side in (-1, 1):
            made.add_particles(two + np.array((0.16 * side, 0, 0)), mass=1000 * SPACING**3,
                velocity=(-5.0 * side, 0, 0))
        made.add_interaction(ps.SPH(smoothing_length=1.3 * SPACING, rest_density=1000.0,
            equation_of_state=ps.Tait(sound_speed=2.0)))
        return made

    yield Row("water faster than its sound", colliding, never, 10, step, names="SPH")
    yield Row("water with twice the drops in one place", partial(scene, np.repeat(two, 2, axis=0),
        ps.SPH(smoothing_length=1.3 * SPACING, rest_density=1000.0,
        equation_of_state=ps.Tait(sound_speed=20.0)), mass=1000 * SPACING**3), never, 4, step,
        names="SPH")


# Laws and boxes ----------------------------------------------------------------------------------


def cube(side):
    return ((0, 0, 0), (side,) * 3)


def of_laws():
    charged = {"charge": [1.0, 3.0], "velocity": (0, 0, 0)}
    yield Row("a pair force by one charge alone", partial(scene, TWO, ps.PairForce(laws.from_charge,
        cutoff=None), **charged), momentum_kept(), 10, {"dt": 0.1}, names="PairForce")
    yield Row("a potential that is another with both exchanged", partial(scene, TWO,
        ps.PairPotential(laws.lopsided, cutoff=None), mass=[1.0, 2.0], charge=[1.0, 3.0]), never,
        names="PairPotential")
    turn = {"velocity": (0, 1, 0)}
    yield Row("a potential twice that of its force", partial(scene, [(1, 0, 0)],
        ps.ParticleForce(laws.trap_force, potential=laws.twice_the_trap, stiffness=1.0)),
        energy_kept(), 20, {"dt": 0.1, **VERLET}, names="ParticleForce")
    yield Row("a potential of a force that has none", partial(scene, [(1, 0, 0)],
        ps.ParticleForce(laws.swirl, potential=laws.trap, stiffness=1.0), **turn), energy_kept(),
        20, {"dt": 0.1, **VERLET}, names="ParticleForce")
    spread = np.random.default_rng(0).uniform(0, 10, (8, 3))
    yield Row("gravity in a periodic box", partial(scene, spread, ps.Gravity(softening=0.5),
        box=cube(10)), never, 4, {"dt": 0.01}, names="Gravity")
    yield Row("charges in a periodic box, by their nearest images", partial(scene, spread,
        ps.PairPotential(laws.coulomb, cutoff=None), charge=np.resize([1, -1], 8), box=cube(10)),
        never, 4, {"dt": 0.01}, names="PairPotential")
    yield Row("a cutoff of more than half a box", partial(scene, TWO, ps.LennardJones(cutoff=2.5),
        box=cube(4)), never, names="cutoff")
    yield Row("a spring of more than half a box", partial(scene, [(1, 5, 5), (7, 5, 5)],
        ps.Springs([(0, 1)], 10.0, 6.0), box=cube(10)), never, names="rest_length")
    yield Row("a field that does not fit a periodic box", partial(scene, [(1, 5, 5)],
        ps.ParticleForce(potential=laws.trap, stiffness=1.0), box=cube(10), velocity=(3, 1, 0)),
        energy_kept(), 100, {"dt": 0.1, **VERLET}, names="ParticleForce")
    yield Row("contacts of points", partial(scene, TWO, ps.Contact()), never, 1, FRAME,
        names="Contact: radius")
    yield Row("a law that asks for what particles do not have", partial(scene, TWO,
        ps.PairPotential(laws.coulomb, cutoff=None)), never, names="charge")

    def add(sim, frame):
        if frame == 1:
            sim.scenes[0].add_particles([(9, 9, 9)])

    yield Row("particles that are added to a scene in motion", partial(scene, TWO), never, 3,
        act=add, names="scene must be complete")
    yield Row("a negative skin", partial(scene, TWO), never, knobs={"skin": -1.0}, names="skin")
    yield Row("an opening angle that sees bodies in their own cell", partial(scene, TWO,
        ps.Gravity()), never, knobs={"opening_angle": 2.0}, names="opening_angle")
    fast = ps.sample.lattice("sc", (4, 4, 4), 1.12)
    yield Row("atoms that pass many cells in a substep", partial(scene, fast,
        ps.LennardJones(cutoff=2.5), velocity=50 * np.sin(7 * fast[:, ::-1])), energy_kept(), 10,
        {"dt": 0.1, "substeps": 2, **EULER}, names="LennardJones|beyond")

    def worlds():
        return [scene([(0, 0, 0), (1.1, 0, 0)], ps.Springs([(0, 1)], k, 1.0), velocity=(0, 0,
            1)) for k in (1.0, 1e6, 1.0)]

    for reaction in ("stop", "freeze", "retry"):
        yield Row(f"one of three worlds that bursts, {reaction}", worlds, never, 40, {"dt": 0.1,
            "substeps": 1, "on_failure": reaction}, names="Springs|world 1")


def rows():
    for family in (of_constraints, of_speed, of_fluids, of_laws):
        yield from family()
