"""A run goes on with the laws that it was started with."""

import pytest
import warp as wp

import particlesim as ps
from particlesim.output import checkpoint

from .runs import Ended, end_at

K = 2.0


@ps.law
def shape(s: float):
    return s * s


@ps.law
def spring(r: float, kind_i: float, kind_j: float, length: float):
    return K * (kind_i + kind_j) * shape(r - length)


def shape_of_third_order(s: float):
    return s * s * s


def weak():
    @ps.law
    def u(r: float):
        return 0.5 * r

    return u


def weak_with_a_comment():
    @ps.law
    def u(r: float):  # energy
        return (0.5 *
                r)  # fmt: skip

    return u


def strong():
    @ps.law
    def u(r: float):
        return 5.0 * r

    return u


def built(law, **parameters):
    scene = ps.Scene()
    kinds = {"kind": [1.0, 2.0]} if "kind_i" in law.parameters else {}
    scene.add_particles([(0, 0, 0), (1, 0, 0)], **kinds)
    scene.add_interaction(ps.PairPotential(law, cutoff=2.0, **parameters))
    return scene


def test_another_law_of_the_same_name_is_refused(tmp_path, refused):
    path = tmp_path / "run.npz"
    ps.Simulation(built(weak()), device="cpu").save(path)
    ps.Simulation.load(path, built(weak_with_a_comment()), device="cpu")
    with refused(r"scene.interactions\[0\].law u must be as in 'run.npz', .*got '.*checksum"):
        ps.Simulation.load(path, built(strong()), device="cpu")


def test_another_helper_is_refused(tmp_path, refused, monkeypatch):
    path = tmp_path / "run.npz"
    ps.Simulation(built(spring, length=1.0), device="cpu").save(path)
    ps.Simulation.load(path, built(spring, length=2.0), device="cpu")  # values may change
    redefined = ps.law(shape_of_third_order)
    monkeypatch.setitem(globals(), "shape", redefined)
    with refused("law spring must"):
        ps.Simulation.load(path, built(spring, length=1.0), device="cpu")


def test_another_number_is_refused(tmp_path, refused, monkeypatch):
    path = tmp_path / "run.npz"
    sim = ps.Simulation(built(spring, length=1.0), device="cpu")
    monkeypatch.setitem(globals(), "K", 3.0)
    sim.save(path)  # with the number that was read when it was made
    with refused("law spring must"):
        ps.Simulation.load(path, built(spring, length=1.0), device="cpu")
    monkeypatch.undo()
    ps.Simulation.load(path, built(spring, length=1.0), device="cpu")


def test_an_older_checkpoint_is_taken(tmp_path):
    path = tmp_path / "run.npz"
    sim = ps.Simulation(built(weak()), device="cpu")
    made = checkpoint.capture(sim.frames, sim.watchdog)
    del made.header["scenes"]["laws"]
    checkpoint.write(made, path)
    ps.Simulation.load(path, built(strong()), device="cpu")


def test_a_constraint_and_a_fluid_have_their_laws_compared(tmp_path, refused):
    def scene(factor):
        @ps.law
        def link(a: wp.vec3, b: wp.vec3):
            return K * wp.length(b - a) - 1.0

        @ps.law
        def pressure(density: float):
            return K * density

        @ps.law
        def energy(density: float):
            return K * wp.log(density)

        @ps.law
        def sound_speed(density: float):
            return K

        scene = ps.Scene()
        x = ps.sample.box((0, 0, 0), (0.4, 0.4, 0.4), spacing=0.1)
        scene.add_particles(x, mass=1.0)
        if factor == "fluid":
            state = ps.EquationOfState()
            state.pressure, state.energy, state.sound_speed = pressure, energy, sound_speed
            scene.add_interaction(ps.SPH(smoothing_length=0.2, equation_of_state=state))
        else:
            scene.add_constraint(ps.Constraint(link, particles=[(0, 1)]))
        return scene

    for factor, told in (
        ("link", "constraints.*law link"),
        ("fluid", "interactions.*law pressure"),
    ):
        path = tmp_path / f"{factor}.npz"
        with pytest.MonkeyPatch.context() as patch:
            ps.Simulation(scene(factor), device="cpu").save(path)
            patch.setitem(globals(), "K", 3.0)
            with refused(told):
                ps.Simulation.load(path, scene(factor), device="cpu")


def test_a_recorded_run_is_resumed_with_its_laws(tmp_path, refused, monkeypatch):
    def sim():
        return ps.Simulation(built(spring, length=1.0), ps.Settings(dt=0.01), device="cpu")

    path = tmp_path / "out.npz"
    with pytest.raises(Ended):
        sim().run(9, record=path, checkpoint=2, progress=end_at(5))
    monkeypatch.setitem(globals(), "K", 3.0)
    with refused("law spring must"):
        sim().run(9, record=path, resume=True)
    monkeypatch.undo()
    sim().run(9, record=path, resume=True)
