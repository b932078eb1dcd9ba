"""What goes as it should, however wild it looks: right, and without a word."""

from functools import partial

import numpy as np

import particlesim as ps

from . import laws
from .judge import (
    VERLET,
    Row,
    as_fine,
    energy_kept,
    equal,
    momentum_kept,
    path,
    scene,
    slower_than,
    whole,
    within,
)

# A table, laid out by hand.
# fmt: off

TWO = [(0, 0, 0), (1, 0, 0)]
FRAME = {"dt": 1 / 60, "substeps": 10}


def down():
    return ps.UniformGravity((0, -9.81, 0))


# One or two particles ----------------------------------------------------------------------------


def thrown(g, v):
    v = np.array(v)
    return lambda t: (t[:, None] * v + 0.5 * (t**2)[:, None] * np.array(g))[:, None]


def of_single():
    g, v = (0, -9.81, 0), (3, 4, 5)
    yield Row("a throw", partial(scene, [(0, 0, 0)], down(), velocity=v), path(thrown(g, v), 1e-3),
        60, {**FRAME, **VERLET})
    yield Row("a throw in steps of a second", partial(scene, [(0, 0, 0)], down(), velocity=v),
        path(thrown(g, v), 1e-3), 20, {"dt": 1.0, "substeps": 1, **VERLET})
    yield Row("a fall by 100 times the size of the scene", partial(scene, TWO, down()),
        slower_than(9.81 * 10, 1.01), 600, FRAME)
    yield Row("a drag race", partial(scene, [(0, 0, 0)], ps.ConstantForce((1e4, 0, 0)),
        ps.Drag(quadratic=1.0)), equal(lambda d: d.v[-1, 0, 0], 100.0, 0.01), 60, {"dt": 0.001,
        "substeps": 4})
    yield Row("a bullet", partial(scene, [(0, 0, 0)], velocity=(1e5, 0, 0)), path(thrown((0, 0, 0),
        (1e5, 0, 0)), 1e-3), 60, FRAME)
    yield Row("a trap", partial(scene, [(1, 0, 0)], ps.ParticleForce(potential=laws.trap,
        stiffness=1.0)), path(lambda t: np.cos(t)[:, None, None] * np.eye(3)[:1], 0.01), 100,
        {"dt": 0.5, "substeps": 20, **VERLET})
    yield Row("a trap with its force and its potential", partial(scene, [(1, 0.5, 0)],
        ps.ParticleForce(laws.trap_force, potential=laws.trap, stiffness=1.0)), energy_kept(0.02),
        60, {"dt": 0.5, "substeps": 20, **VERLET})
    yield Row("a soft wall", partial(scene, [(0, 0, 0)], ps.ParticleForce(potential=laws.wall,
        stiffness=400.0, place=1.0), velocity=(1, 0, 0)), energy_kept(0.02), 60, {"dt": 0.05,
        "substeps": 10, **VERLET})
    yield Row("heavy damping", partial(scene, [(0, 0, 0)], ps.Drag(50.0), velocity=(10, 0, 0)),
        equal(lambda d: d.x[-1, 0, 0], 0.2, 0.02), 60, {"dt": 0.02, "substeps": 100})
    yield Row("stirred by a force of time", partial(scene, [(0, 0, 0)],
        ps.ParticleForce(laws.shaking, omega=2.0, strength=1.0)),
        path(lambda t: ((1 - np.cos(2 * t)) / 4)[:, None, None] * np.eye(3)[:1], 0.02), 100,
        {"dt": 0.1, "substeps": 20, **VERLET})
    long = ps.ParticleForce(laws.pulse, start=0.5, length=0.5, push=20.0)
    yield Row("a long pulse", partial(scene, [(0, 0, 0)], long), equal(lambda d: d.v[-1, 0, 0],
        10.0, 0.02), 60, {"dt": 0.025, "substeps": 20})
    yield Row("pinned, whatever pulls", partial(scene, TWO, down(), ps.Springs([(0, 1)], 1e9, 0.1),
        pinned=True), within(1.0, 1.0), 10, FRAME)
    yield Row("nobody", partial(scene, np.zeros((0, 3)), down()), lambda done: 0.0, 5, FRAME)
    yield Row("nothing but time", partial(scene, TWO), within(1.0, 1.0), 60, FRAME)


def of_springs():
    yield Row("a spring let go", partial(scene, [(0, 0, 0), (1.8, 0, 0)], ps.Springs([(0, 1)],
        100.0, 1.0)), energy_kept(0.02), 100, {"dt": 0.05, "substeps": 10, **VERLET})
    chain = [(1.5 * k, 0.1 * (k % 2), 0) for k in range(20)]
    links = [(k, k + 1) for k in range(19)]
    yield Row("a chain let go", partial(scene, chain, ps.Springs(links, 100.0, 1.0)),
        energy_kept(0.05), 60, {"dt": 0.05, "substeps": 10, **VERLET})
    yield Row("a chain that comes to rest", partial(scene, chain, ps.Springs(links, 100.0, 1.0,
        5.0)), as_fine(16), 60, {"dt": 0.05, "substeps": 25})
    yield Row("springs between masses of 1e4 : 1", partial(scene, [(0, 0, 0), (1.2, 0, 0)],
        ps.Springs([(0, 1)], 1.0, 1.0), mass=[1e4, 1.0]), energy_kept(0.02), 60, {"dt": 0.5,
        "substeps": 10, **VERLET})
    yield Row("a spring at 1e4", partial(scene, [(1e4, 0, 0), (1e4 + 1.2, 0, 0)], ps.Springs([(0,
        1)], 100.0, 1.0)), energy_kept(0.05, 2.0), 30, {"dt": 0.02, "substeps": 10, **VERLET})
    yield Row("a penalty", partial(scene, [(0, 0, 0), (1.5, 0, 0)], ps.Distance([(0, 1)], 1.0,
        compliance=0.01).as_force()), energy_kept(0.02, 12.5), 60, {"dt": 0.05, "substeps": 10,
        **VERLET})


def of_pairs():
    fine = {"dt": 0.02, "substeps": 20, **VERLET}
    for speed in (1.0, 5.0, 30.0):
        dt = 0.1 / speed
        yield Row(f"atoms that meet at {speed}", partial(scene, [(0, 0, 0), (3.9, 0, 0)],
            ps.LennardJones(cutoff=4.0, truncation="force_shift"), velocity=[(speed / 2, 0, 0),
            (-speed / 2, 0, 0)]), energy_kept(0.02), 60, {"dt": dt, "substeps": 100, **VERLET})
    yield Row("an atom bound to another", partial(scene, [(0, 0, 0), (1.3, 0, 0)],
        ps.LennardJones(cutoff=4.0)), energy_kept(0.02, 1.0), 100, fine)
    x = ps.sample.lattice("fcc", (3, 3, 3), 1.7)
    for temperature in (0.1, 1.5, 20.0):
        v = ps.sample.maxwell_boltzmann(len(x), temperature, 1.0, seed=0)
        yield Row(
            f"a dense liquid at {temperature}",
            partial(
                scene,
                x,
                ps.LennardJones(cutoff=2.5, truncation="force_shift"),
                box=((0, 0, 0), (5.1,) * 3),
                velocity=v,
            ),
            energy_kept(0.05),
            40,
            {"dt": 0.02, "substeps": 20 if temperature < 10 else 60, **VERLET},
        )
    squeezed = 0.75 * x[:60]
    yield Row("an explosion of squeezed atoms", partial(scene, squeezed, ps.LennardJones(cutoff=2.5,
        truncation="force_shift")), energy_kept(0.02), 40, {"dt": 0.005, "substeps": 100, **VERLET})
    corners = 2.0 * np.array([(i, j, k) for i in (0, 1) for j in (0, 1) for k in (0, 1)])
    yield Row("like charges that fly apart", partial(scene, 0.1 * corners,
        ps.PairPotential(laws.coulomb, cutoff=None), charge=1.0), energy_kept(0.02), 40,
        {"dt": 0.01, "substeps": 100, **VERLET})
    yield Row("charged particles with cores", partial(scene, corners, ps.PairPotential(laws.coulomb,
        cutoff=None), ps.LennardJones(cutoff=2.5), charge=np.where(corners.sum(1) % 4 == 0, 1.0,
        -1.0)), energy_kept(0.05), 40, {"dt": 0.02, "substeps": 50, **VERLET})
    yield Row(
        "screened charges in a periodic box, without a cutoff",
        partial(
            scene,
            5 * corners + 1,
            ps.PairPotential(laws.yukawa, cutoff=None, strength=1.0, screening=0.3),
            box=((0, 0, 0), (20,) * 3),
            velocity=np.sin(corners[:, ::-1]),
        ),
        energy_kept(0.02),
        40,
        fine,
    )
    yield Row("grains of a force law", partial(scene, [(0, 0, 0), (0.03, 0, 0)],
        ps.PairForce(laws.grains, cutoff=0.025, stiffness=1e3, diameter=0.02), mass=1e-3,
        velocity=[(0.5, 0, 0), (-0.5, 0, 0)]), slower_than(0.5, 1.02), 60, {"dt": 1e-3,
        "substeps": 10, **VERLET})


def of_gravity():
    pair = {"mass": 0.5, "velocity": [(0, -0.5, 0), (0, 0.5, 0)]}
    yield Row("two stars that circle", partial(scene, TWO, ps.Gravity(), **pair), energy_kept(0.01),
        60, {"dt": 0.2, "substeps": 20, **VERLET})
    yield Row("a comet of e = 0.6 in fine steps", partial(scene, [(0, 0, 0), (1.6, 0, 0)],
        ps.Gravity(), mass=[1.0, 1e-6], pinned=[True, False], velocity=[(0, 0, 0), (0, 0.5, 0)]),
        energy_kept(0.02), 60, {"dt": 0.2, "substeps": 60, **VERLET})
    sun = {"mass": [1.989e30, 1.898e27], "velocity": [(0, 0, 0), (0, 13070.0, 0)]}
    yield Row("Sun and Jupiter in SI", partial(scene, [(0, 0, 0), (7.78e11, 0, 0)],
        ps.Gravity(G=6.6743e-11), **sun), energy_kept(0.01), 60, {"dt": 8.64e6, "substeps": 50,
        **VERLET})
    yield Row("a flyby", partial(scene, [(0, 0, 0), (-5, 1, 0)], ps.Gravity(), mass=[1.0, 1e-6],
        pinned=[True, False], velocity=[(0, 0, 0), (3, 0, 0)]), energy_kept(0.01), 60, {"dt": 0.1,
        "substeps": 20, **VERLET})
    blob = np.random.default_rng(0).normal(size=(40, 3))
    yield Row("a soft cluster that collapses", partial(scene, blob, ps.Gravity(softening=0.3),
        mass=1 / 40), energy_kept(0.05), 60, {"dt": 0.1, "substeps": 20, **VERLET})


def of_constraints():
    rope = [(0.1 * k, 0, 0) for k in range(11)]
    held = {"mass": 0.01, "pinned": np.arange(11) == 0}
    links = [(k, k + 1) for k in range(10)]
    many = {"dt": 1 / 60, "substeps": 40, "iterations": 4}
    yield Row("a pendulum of rods", partial(scene, rope, down(), ps.Distance(links), **held),
        within(1.0, 1.02), 60, many)
    yield Row("a soft rope", partial(scene, rope, down(), ps.Distance(links, compliance=1e-3),
        **held), as_fine(16, 0.1), 20, many)
    yield Row("a rope that tears", partial(scene, rope, down(), ps.Distance(links, compliance=1e-5,
        break_force=0.3), **{**held, "mass": np.where(np.arange(11) == 10, 0.5, 0.01)}),
        lambda done: 0.0 if done.x[-1, -1, 1] < -1.5 else np.inf, 60, many)
    one = {"radius": 0.1}
    yield Row("a ball that bounces", partial(scene, [(0, 1.1, 0)], down(), ps.PlaneBoundary((0, 0,
        0), (0, 1, 0), restitution=1.0), **one), equal(lambda d: d.x[30:, 0, 1].max(), 1.1, 0.03),
        60, {"dt": 1 / 60, "substeps": 40})
    yield Row("a heavy ball that hits a light one", partial(scene, TWO, ps.Contact(restitution=1.0),
        mass=[1e4, 1.0], radius=0.2, velocity=[(1, 0, 0), (0, 0, 0)]), equal(lambda d: d.v[-1, 1,
        0], 2.0, 0.01), 60, FRAME)
    rng = np.random.default_rng(0)
    yield Row("billiards", partial(scene, np.vstack([(-1, 0, 0), ps.sample.lattice("sc", (3, 3, 1),
        0.21)]), ps.Contact(restitution=1.0), radius=0.1, velocity=np.vstack([(8, 0.5, 0),
        np.zeros((9, 3))])), energy_kept(0.02), 60, {"dt": 1 / 60, "substeps": 20})
    overlapping = rng.uniform(0, 0.3, (20, 3))
    yield Row("overlaps that ease", partial(scene, overlapping, ps.Contact(), radius=0.1),
        slower_than(6.0, 1.0), 60, FRAME)
    yield Row("a start within a wall", partial(scene, [(0, 0.05, 0)], ps.PlaneBoundary((0, 0, 0),
        (0, 1, 0)), **one), slower_than(6.0, 1.0), 60, FRAME)
    for name, motion in (("moves", {"velocity": (0, 1, 0)}), ("shears", {"velocity": (1, 0, 0)})):
        yield Row(f"a floor that {name}", partial(scene, [(0, 0.1, 0), (1, 0.1, 0)], down(),
            ps.PlaneBoundary((0, 0, 0), (0, 1, 0), friction=0.5, **motion), **one), slower_than(1.0,
            1.1), 60, {"dt": 1 / 60, "substeps": 20})
    yield Row("a gas between walls", partial(scene, rng.uniform(0.2, 1.8, (30, 3)),
        ps.Contact(restitution=1.0), ps.BoxBoundary((0, 0, 0), (2, 2, 2), restitution=1.0),
        radius=0.05, velocity=rng.normal(size=(30, 3))), energy_kept(0.05), 60, FRAME)
    pile = ps.sample.lattice("sc", (3, 3, 3), 0.21) + np.array((0, 0.1, 0))
    yield Row("a pile at rest", partial(scene, pile, down(), ps.Contact(friction=0.5),
        ps.PlaneBoundary((0, 0, 0), (0, 1, 0), friction=0.5), radius=0.1), slower_than(0.5, 1.0),
        60, {"dt": 1 / 60, "substeps": 20, "iterations": 4})


def of_fluids():
    s = 0.05
    x = ps.sample.box((0, 0, 0), (0.4, 0.4, 0.4), s)

    def fluid(mass=1.0, speed=20.0, h=1.3, parts=(), **particles):
        water = ps.SPH(smoothing_length=h * s, rest_density=1000.0,
            equation_of_state=ps.Tait(sound_speed=speed), viscosity=ps.ArtificialViscosity(0.1))
        return scene(x, water, *parts, mass=mass * 1000 * s**3, **particles)

    step = {"dt": 1 / 60, "substeps": 24}
    for h in (1.2, 1.3, 2.0):
        yield Row(f"a drop at rest, h = {h}", partial(fluid, h=h), slower_than(0.5), 12, step)
    yield Row("a drop that falls", partial(fluid, parts=(down(),)), momentum_of_fall, 12, step)
    yield Row("a drop that flies fast", partial(fluid, velocity=(50, 0, 0)), momentum_kept(1e-3),
        12, step)
    gas = ps.SPH(smoothing_length=1.3 * s, equation_of_state=ps.Polytrope(1.0, 1.0))
    yield Row("a gas that expands", partial(scene, x, gas, mass=s**3), momentum_kept(1e-3), 20,
        {"dt": 0.01, "substeps": 10})
    yield Row("a gas faster than its sound", partial(scene, x, gas, mass=s**3,
        velocity=30 * (x - x.mean(axis=0))), energy_kept(0.05), 20, {"dt": 0.005, "substeps": 20})


def momentum_of_fall(done):
    """Off in the momentum of a free fall, by parts of 1 %."""
    fall = done.sums[-1].mass[0] * 9.81 * done.times[-1]
    return whole(abs(done.momentum[-1, 0, 1] + fall) / (0.01 * fall))


def of_runs():
    def back(sim, frame):
        if frame % 20 == 10:
            sim.reset()

    spring = partial(scene, [(0, 0, 0), (1.3, 0, 0)], ps.Springs([(0, 1)], 10.0, 1.0))
    yield Row("resets", spring, slower_than(1.0, 1.0), 100, FRAME, act=back)

    def faster(sim, frame):
        if frame == 20:
            sim.velocity = 100.0 * np.asarray(sim.velocity) + np.array((50, 0, 0))

    yield Row("velocities that are set", spring, slower_than(80.0, 1.0), 60, {"dt": 0.005,
        "substeps": 10}, act=faster)

    def away(sim, frame):
        if frame == 20:
            sim.position = np.asarray(sim.position) + np.array((200, 0, 0))

    yield Row("positions that are set", spring, within(200.0, 1.1), 60, FRAME, act=away)
    yield Row("a long run", spring, energy_kept(0.02, 0.2), 2000, {"dt": 0.2, "substeps": 10,
        **VERLET})
    yield Row("many worlds", lambda: [spring() for _ in range(3)], energy_kept(0.02, 0.2), 40,
        {**FRAME, **VERLET})


def rows():
    for family in (
        of_single,
        of_springs,
        of_pairs,
        of_gravity,
        of_constraints,
        of_fluids,
        of_runs,
    ):
        yield from family()
