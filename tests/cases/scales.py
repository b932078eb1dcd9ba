"""One scene of each part, in any units: the motion is the same but for the scale."""

from typing import NamedTuple

import numpy as np
import warp as wp

import particlesim as ps


class Units(NamedTuple):
    """What a length, mass, time and charge of 1 become."""

    length: float
    mass: float
    time: float
    charge: float = 1.0

    def of(self, length=0, mass=0, time=0, charge=0):
        """The unit of a quantity of these powers, as Python computes it: a product that leaves
        double precision on its way is made in another order."""
        exponent = (
            length * np.log2(self.length) + mass * np.log2(self.mass)
            + time * np.log2(self.time) + charge * np.log2(self.charge)
        )  # fmt: skip
        return float(2.0**exponent)


UNITS = {
    "atoms": Units(3.4e-10, 6.6e-26, 2.2e-12, 1.6e-19),
    "electron": Units(5.3e-11, 9.1e-31, 2.4e-17, 1.6e-19),
    "colloid": Units(1e-6, 4e-15, 1e-3, 1.6e-17),
    "nuclear": Units(1e-15, 1.7e-27, 1e-23, 1.6e-19),
    "planets": Units(1.5e11, 2e30, 5e6),
    "star": Units(1e9, 1e29, 1.2e4),
    "galaxy": Units(3e20, 2e41, 1.4e15),
    "all 1e-30": Units(1e-30, 1e-30, 1e-30, 1e-30),
}
PLAIN = Units(1.0, 1.0, 1.0)
FRAMES = 24


@ps.law
def powers(r: float, c12: float, c6: float):
    s = 1.0 / (r * r * r * r * r * r)
    return c12 * s * s - c6 * s


@ps.law
def coulomb(r: float, charge_i: float, charge_j: float, constant: float):
    return (constant * charge_i) * (charge_j / r)


def particles(u, x, v=(0, 0, 0), mass=1.0, radius=0.0, **more):
    scene = ps.Scene()
    scene.add_particles(
        np.asarray(x) * u.of(length=1), velocity=np.asarray(v) * u.of(length=1, time=-1),
        mass=np.asarray(mass) * u.of(mass=1), radius=radius * u.of(length=1), **more,
    )  # fmt: skip
    return scene


TRIANGLE = [(0, 0, 0), (1.15, 0, 0), (0.5, 1.1, 0.2)]
SPIN = [(0, 0.3, 0), (0, -0.2, 0.1), (0.2, 0, -0.1)]


def lennard_jones(u):
    scene = particles(u, TRIANGLE, SPIN, mass=(1.0, 2.0, 1.5))
    energy = u.of(2, 1, -2)
    scene.add_interaction(ps.LennardJones(epsilon=energy, sigma=u.length, cutoff=3.0 * u.length))
    return scene


def law_of_powers(u):
    scene = particles(u, TRIANGLE, SPIN, mass=(1.0, 2.0, 1.5))
    scene.add_interaction(
        ps.PairPotential(powers, cutoff=None, c12=4.0 * u.of(14, 1, -2), c6=4.0 * u.of(8, 1, -2))
    )
    return scene


def charges(u):
    scene = particles(
        u, TRIANGLE, SPIN, mass=(1.0, 2.0, 1.5), charge=np.array((1.0, 2.0, 0.5)) * u.charge
    )
    scene.add_interaction(ps.PairPotential(coulomb, cutoff=None, constant=u.of(3, 1, -2, -2)))
    return scene


def gravity(u):
    scene = particles(u, [(0, 0, 0), (1, 0, 0), (0, 1.6, 0.1)],
                      [(0, -0.3, 0), (0, 1, 0), (-0.8, 0, 0.1)], mass=(1.0, 0.1, 1e-3))  # fmt: skip
    scene.add_interaction(ps.Gravity(G=u.of(3, -1, -2)))
    return scene


def springs(u):
    scene = particles(u, TRIANGLE, SPIN, mass=(1.0, 2.0, 1.5))
    scene.add_interaction(
        ps.Springs(
            [(0, 1), (1, 2), (0, 2)], stiffness=5.0 * u.of(mass=1, time=-2),
            rest_length=1.0 * u.length, damping=0.2 * u.of(mass=1, time=-1),
        )
    )  # fmt: skip
    return scene


@ps.law
def torsion(dihedral: float, barrier: float):
    return barrier * wp.cos(dihedral)


def molecule(u):
    """Four in a chain that swings, bends and turns."""
    scene = particles(u, [*TRIANGLE, (1.3, 1.6, 0.9)], [*SPIN, (0, 0, 0.2)], mass=(1, 2, 1.5, 0.8))
    energy = u.of(2, 1, -2)
    bonds = [(0, 1), (1, 2), (2, 3)]
    scene.add_interaction(ps.FENEBonds(bonds, 5.0 * u.of(mass=1, time=-2), 2.0 * u.length))
    scene.add_interaction(ps.HarmonicBonds(bonds, 5.0 * u.of(mass=1, time=-2), 1.2 * u.length))
    scene.add_interaction(ps.HarmonicAngles([(0, 1, 2), (1, 2, 3)], 2.0 * energy, 1.7))
    scene.add_interaction(ps.Dihedrals([(0, 1, 2, 3)], torsion, barrier=0.5 * energy))
    return scene


def drag(u):
    scene = particles(u, TRIANGLE, SPIN, mass=(1.0, 2.0, 1.5))
    scene.add_interaction(
        ps.Drag(
            linear=0.5 * u.of(mass=1, time=-1), quadratic=0.5 * u.of(mass=1, length=-1),
            flow=np.array((0.1, 0, 0.2)) * u.of(length=1, time=-1),
        )
    )  # fmt: skip
    return scene


def fluid(u):
    x = ps.sample.box((0, 0, 0), (0.5, 0.5, 0.5), 0.1)
    scene = particles(u, x, 0.2 * np.sin(3.0 * x[:, ::-1]), mass=1e-3)
    scene.add_interaction(
        ps.SPH(
            smoothing_length=0.13 * u.length, rest_density=u.of(length=-3, mass=1),
            equation_of_state=ps.Tait(sound_speed=3.0 * u.of(length=1, time=-1)),
            viscosity=ps.ArtificialViscosity(0.1),
        )
    )  # fmt: skip
    return scene


def contact(u):
    """One ball hits two that touch, obliquely and with friction."""
    scene = particles(u, [(0, 0, 0), (1.0, 0.1, 0), (0.2, 1.15, 0)],
                      [(0.5, 0, 0), (-0.5, 0.2, 0), (0, -0.5, 0)], mass=(1.0, 2.0, 1.5),
                      radius=0.45)  # fmt: skip
    scene.add_constraint(ps.Contact(friction=0.3, restitution=0.5))
    return scene


def soft(u):
    scene = particles(u, TRIANGLE, SPIN, mass=(1.0, 2.0, 1.5))
    scene.add_constraint(
        ps.Distance([(0, 1), (1, 2), (0, 2)], 1.0 * u.length,
                    compliance=0.2 * u.of(mass=-1, time=2))
    )  # fmt: skip
    return scene


def rigid(u):
    scene = particles(u, TRIANGLE, SPIN, mass=(1.0, 2.0, 1.5))
    scene.add_constraint(ps.Distance([(0, 1), (1, 2), (0, 2)]))
    return scene


@ps.law
def bend(a: wp.vec3, b: wp.vec3, c: wp.vec3, cosine: float):
    return wp.dot(wp.normalize(a - b), wp.normalize(c - b)) - cosine


def angle(u):
    scene = particles(u, TRIANGLE, SPIN, mass=(1.0, 2.0, 1.5))
    scene.add_constraint(
        ps.Constraint(bend, [(0, 1, 2)], cosine=0.5, compliance=0.2 / u.of(2, 1, -2))
    )
    return scene


def penalty(u):
    scene = particles(u, TRIANGLE, SPIN, mass=(1.0, 2.0, 1.5))
    rods = ps.Distance(
        [(0, 1), (1, 2), (0, 2)], 1.0 * u.length, compliance=0.2 * u.of(mass=-1, time=2),
        damping=0.1 * u.of(mass=1, time=-1),
    )  # fmt: skip
    scene.add_interaction(rods.as_force())
    return scene


def walls(u):
    """Two balls that fall onto a floor and along a wall, with friction, and bounce."""
    scene = particles(u, [(0.31, 0.43, 0), (1.13, 0.37, 0.02)], [(-0.83, 0, 0.3), (0.7, -0.5, 0.1)],
                      mass=(1.0, 2.0), radius=0.2)  # fmt: skip
    scene.add_interaction(ps.UniformGravity(np.array((0, -1, 0)) * u.of(length=1, time=-2)))
    scene.add_constraint(
        ps.BoxBoundary(
            np.array((0, 0, -9)) * u.length, np.full(3, np.inf), friction=0.3, restitution=0.5
        )
    )  # fmt: skip
    scene.add_constraint(
        ps.SphereBoundary(np.array((2.0, 0.3, 0)) * u.length, 0.4 * u.length, inside=False)
    )
    return scene


def gas(u):
    side = 3 * 1.7 * u.length
    scene = ps.Scene(periodic=((0, 0, 0), (side, side, side)))
    x = ps.sample.lattice("sc", (3, 3, 3), 1.7)
    v = 0.7 * np.sin(5.0 * x[:, ::-1])
    scene.add_particles(x * u.length, velocity=v * u.of(length=1, time=-1), mass=u.mass)
    energy = u.of(2, 1, -2)
    scene.add_interaction(ps.LennardJones(epsilon=energy, sigma=u.length, cutoff=2.5 * u.length))
    return scene


VERLET = {"substeps": 10, "integrator": "velocity_verlet"}
KNOBS = {
    soft: {"substeps": 10},
    rigid: {"substeps": 10},
    angle: {"substeps": 10},
    walls: {"substeps": 2},
    # Friction goes by the overlap of one substep, which positions of single precision have to
    # eps / (v h): here 1e-7 / 0.02.
    contact: {"substeps": 2},
}
PARTS = {each.__name__: each for each in (
    lennard_jones, law_of_powers, charges, gravity, springs, molecule, drag, fluid, contact, soft,
    rigid, angle, penalty, walls, gas,
)}  # fmt: skip


def motion(part, units, precision):
    """Positions of a part's scene over some frames, in its units, and its energies likewise."""
    knobs = ps.Settings(dt=0.05 * units.time, precision=precision, **KNOBS.get(part, VERLET))
    sim = ps.Simulation(part(units), knobs, device="cpu")
    x, energy = [], []
    for _ in range(FRAMES):
        sim.run(1)
        x.append(sim.state.unwrapped() / units.length)
        energy.append(sim.diagnostics().energy[0] / units.of(2, 1, -2))
    return np.array(x), np.array(energy)
