"""Forces that depend on velocity: order of convergence, turns without gain, and the ledger."""

import itertools

import numpy as np
import pytest
import warp as wp

import particlesim as ps


@ps.law
def lorentz(velocity: wp.vec3, b: wp.vec3):
    return wp.cross(velocity, b)


@ps.law
def uneven(position: wp.vec3, velocity: wp.vec3):
    return (1.0 + 0.3 * position[0]) * wp.cross(velocity, wp.vec3(0.0, 0.0, 1.0))


@ps.law
def slowing(velocity: wp.vec3, time: float):
    return -(1.0 + wp.sin(time)) * velocity


@ps.law
def looped(velocity: wp.vec3, rounds: int):
    f = wp.vec3(0.0, 0.0, 0.0)
    for _ in range(rounds):
        f = f - 0.25 * velocity
    return f


@wp.kernel(module="unique")
def resist(v: wp.array(dtype=wp.vec3d), f: wp.array(dtype=wp.vec3d)):
    i = wp.tid()
    f[i] = f[i] - wp.length(v[i]) * v[i]


class Own(ps.Interaction):
    """Quadratic drag of one's own, b = 1."""

    def prepare(self, model, neighbors):
        self.model = model

    def apply(self, state, neighbors, dt):
        inputs = [state.velocity, state.force]
        wp.launch(resist, state.count, inputs, device=self.model.device)


def field():
    return ps.ParticleForce(lorentz, b=(0, 0, 1.0))


def damped():
    return ps.Springs([(0, 1)], 1.0, 1.0, damping=0.5)


def damper():
    link = ps.Distance([(0, 1)], rest_length=1.0, compliance=1.0, damping=0.5)
    return link.as_force()


PARTS = {
    "magnetic": (field,),
    "magnetic and electric": (field, lambda: ps.ConstantForce((0.3, 0.2, 0.1))),
    "uneven field and springs": (lambda: ps.ParticleForce(uneven), damped),
    "linear drag": (lambda: ps.Drag(0.5),),
    "quadratic drag": (lambda: ps.Drag(0.1, 1.0, flow=(0.2, 0, 0)),),
    "drag and field": (lambda: ps.Drag(0.0, 1.0), field),
    "drag in time": (lambda: ps.ParticleForce(slowing),),
    "damped springs": (damped,),
    "damped springs and drag": (damped, lambda: ps.Drag(0.3)),
    "a law that loops": (lambda: ps.ParticleForce(looped, rounds=3),),
    "a constraint as a force": (damper,),
    "one's own": (Own,),
}  # fmt: skip


def scene_of(parts):
    scene = ps.Scene()
    scene.add_particles(
        [(1.3, 0, 0), (0, 0, 0.2)], velocity=[(0, -1, 0), (0.3, 0, 0)], mass=[1.0, 2.0]
    )
    for part in parts:
        scene.add_interaction(part())
    return scene


def ended(scene, steps, device, span=2.0, **knobs):
    settings = ps.Settings(**{"dt": span, "substeps": steps, "precision": "float64", **knobs})
    sim = ps.Simulation(scene, settings, device=device)
    sim.step()
    return np.concatenate([sim.position.ravel(), sim.velocity.ravel()])


@pytest.mark.parametrize("name", PARTS)
def test_verlet_is_of_second_order(name, device):
    # Richardson: halving dt divides the change by 4, to leading order in dt, of which the next
    # is some dt = 0.03 of it: log2 is off by up to 0.03 / ln 2.
    scene = scene_of(PARTS[name])
    ends = [ended(scene, n, device, integrator="velocity_verlet") for n in (64, 128, 256)]
    changes = [np.linalg.norm(b - a) for a, b in itertools.pairwise(ends)]
    assert np.log2(changes[0] / changes[1]) == pytest.approx(2.0, abs=0.05)
    # And to the same end as the other method, which is off by some dt of the motion.
    euler = ended(scene, 256, device)
    assert np.linalg.norm(euler - ends[-1]) < 2 * 2.0 / 256


@pytest.mark.parametrize("integrator", ["symplectic_euler", "velocity_verlet"])
def test_a_charge_keeps_its_speed(integrator, precision, device):
    # Boris's rotation keeps it but for rounding: 20 000 kicks of up to 2 eps of it, at random, and
    # the same way for the worst.
    scene = ps.Scene()
    scene.add_particles([(1, 0, 0)], velocity=(0, -1, 0))
    scene.add_interaction(field())
    settings = ps.Settings(
        dt=2 * np.pi, substeps=20, integrator=integrator, precision=precision, watchdog=False
    )
    sim = ps.Simulation(scene, settings, device=device)
    for _ in range(1000):
        sim.step()
    assert np.linalg.norm(sim.velocity) == pytest.approx(1.0, abs=1e-3)
    assert np.abs(np.linalg.norm(sim.velocity) - 1) < 2e4 * 2 * np.finfo(precision).eps


def test_a_turn_is_as_the_tangent_says(device):
    # tan(turn / 2) = omega dt / 2 (Boris 1970), at any step.
    scene = ps.Scene()
    scene.add_particles([(0, 0, 0)], velocity=(1, 0, 0))
    scene.add_interaction(field())
    for dt in (0.1, 2.0, 50.0):
        end = ended(scene, 1, device, span=dt)
        turn = 2 * np.arctan(dt / 2)
        np.testing.assert_allclose(end[3:5], [np.cos(turn), -np.sin(turn)], rtol=0, atol=1e-14)


def test_drag_is_stable_at_any_step(precision, device):
    # Verlet is linearly implicit: however large b u dt, a velocity is turned about at most.
    for part in (ps.Drag(0.0, 1.0), ps.Drag(1.0)):
        scene = ps.Scene()
        scene.add_particles([(0, 0, 0)], velocity=(3, 0, 0))
        scene.add_interaction(part)
        knobs = {"precision": precision, "integrator": "velocity_verlet", "watchdog": False}
        sim = ps.Simulation(scene, ps.Settings(dt=1e12, substeps=1, **knobs), device=device)
        for _ in range(5):
            sim.step()
        assert abs(sim.velocity[0, 0]) <= 3.0


@pytest.mark.parametrize("integrator", ["symplectic_euler", "velocity_verlet"])
@pytest.mark.parametrize("name", ["drag and field", "damped springs and drag"])
def test_the_ledger_closes(name, integrator, device):
    settings = ps.Settings(
        dt=0.1, substeps=4, precision="float64", integrator=integrator, ledger=True
    )
    sim = ps.Simulation(scene_of(PARTS[name]), settings, device=device)
    for _ in range(10):
        sim.step()
    ledger = sim.ledger()
    # 40 substeps of numbers of the size of 1.
    assert np.abs(ledger.unaccounted).max() < 40 * 10 * np.finfo(float).eps
    assert np.abs(ledger.unaccounted_momentum).max() < 40 * 10 * np.finfo(float).eps
    drag = ledger["Drag"].work[0]
    assert drag < 0
    if name == "drag and field":  # which does no work, but for the step of Verlet's halves
        assert abs(ledger["ParticleForce"].work[0]) < 0.01 * abs(drag)


def test_what_hangs_at_rest_feels_no_drag(device):
    # Under an explicit kick nothing moves, and nothing resists: the link carries the weight.
    scene = ps.Scene()
    scene.add_particles([(0, 0, 0), (0, -1, 0)], pinned=[True, False], mass=2.0)
    scene.add_interaction(ps.UniformGravity((0, -10, 0)))
    scene.add_interaction(ps.Drag(5.0))
    link = scene.add_constraint(ps.Distance([(0, 1)]))
    settings = ps.Settings(dt=0.1, substeps=10, precision="float64")
    sim = ps.Simulation(scene, settings, device=device)
    for _ in range(20):
        sim.step()
    assert sim.force(link)[0] == pytest.approx(20.0, rel=1e-12)


def test_worlds_and_restarts_go_as_they_go_alone(tmp_path, device):
    parts = (field, damped, lambda: ps.Drag(0.1, 0.2))
    settings = ps.Settings(dt=0.1, substeps=4, integrator="velocity_verlet")
    scenes = [scene_of(parts) for _ in range(3)]
    alone, batch = ps.Simulation(scenes[0], settings, device=device), None
    batch = ps.Simulation(scenes, settings, device=device)
    for _ in range(5):
        alone.step()
        batch.step()
    for w in range(3):
        np.testing.assert_array_equal(batch.world(w).position, alone.position)
    alone.save(tmp_path / "half.npz")
    again = ps.Simulation.load(tmp_path / "half.npz", scenes[0], device=device)
    for _ in range(5):
        alone.step()
        again.step()
    np.testing.assert_array_equal(alone.velocity, again.velocity)


def test_a_law_without_a_derivative_somewhere_is_explicit_there(device):
    @ps.law
    def root(velocity: wp.vec3):
        return -wp.sqrt(wp.dot(velocity, velocity)) * velocity

    # At rest the root has no derivative: nothing must come of it.
    scene = ps.Scene()
    scene.add_particles([(0, 0, 0), (1, 0, 0)], velocity=[(0, 0, 0), (1, 0, 0)])
    scene.add_interaction(ps.ParticleForce(root))
    end = ended(scene, 100, device, span=1.0, integrator="velocity_verlet")
    assert (end[[0, 1, 2, 6, 7, 8]] == 0).all()
    assert end[9] == pytest.approx(0.5, rel=1e-4)  # v = 1 / (1 + t), and dt^2 of it
