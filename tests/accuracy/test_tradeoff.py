"""Trade-offs: the sweep, its errors and references."""

import math
import re

import numpy as np
import pytest

import particlesim as ps
from particlesim.accuracy.run import Run, array_bytes
from particlesim.accuracy.study import Study

EXACT = ps.Settings(dt=0.1, precision="float64")


def fall(height=1.0, count=1):
    """Particles that fall freely; symplectic Euler is g h t / 2 too low after t."""
    scene = ps.Scene()
    scene.add_particles([(k, height, 0) for k in range(count)])
    scene.add_interaction(ps.UniformGravity((0, -10, 0)))
    return scene


def too_low(sim):
    return float(1 - 5 * sim.time**2 - sim.position[0, 1])


def oscillator(stiffness=100.0):
    """omega = 10: symplectic Euler explodes at h > 0.2."""
    scene = ps.Scene()
    scene.add_particles([(0, 0, 0)], pinned=True)
    scene.add_particles([(1.3, 0, 0)])
    scene.add_interaction(ps.Springs([(0, 1)], stiffness, 1.0))
    return scene


def sweep(build=fall, vary=None, **arguments):
    arguments = {
        "error": too_low, "frames": 4, "settings": EXACT, "repeats": 1, "device": "cpu",
        **arguments,
    }  # fmt: skip
    return ps.tradeoff(build, {"substeps": [1, 2, 4]} if vary is None else vary, **arguments)


def test_a_sweep_on_a_terminal_shows_a_bar(capsys, monkeypatch):
    monkeypatch.setenv("FORCE_COLOR", "1")
    monkeypatch.setenv("COLUMNS", "160")
    sweep(progress=True)
    bar = capsys.readouterr().err
    assert "fall" in bar and "12/12" in bar and "frames" in bar


# The sweep


def test_a_sweep(device):
    seen = []
    table = sweep(
        vary={"substeps": [1, 2], "height": [1.0, 2.0]}, repeats=3, device=device,
        error=lambda sim: sim.position[0, 1], progress=lambda *at: seen.append(at),
    )  # fmt: skip
    assert [tuple(r.values.values()) for r in table.rows] == [(1, 1), (1, 2), (2, 1), (2, 2)]
    assert table.vary == {"substeps": [1, 2], "height": [1.0, 2.0]}
    assert all(len(r.costs) == 3 and r.cost > 0 for r in table.rows)
    assert table.rows[3].options == {"height": 2.0} and table.rows[3].settings.substeps == 2
    # 4 settings, 4 frames, 3 times.
    assert seen == [(k, 48) for k in range(1, 49)]
    # After 0.4 s in steps of 0.1: 1 - 10 * 0.1^2 * (1 + 2 + 3 + 4) = 0; an error has no sign.
    assert table.rows[0].error == pytest.approx(0.0, abs=1e-12)
    assert table.duration == pytest.approx(0.4)


def test_settings_run_in_turn(monkeypatch):
    order = []
    advance = Run.advance
    monkeypatch.setattr(
        Run, "advance",
        lambda self, *rest: (order.append(self.plan.values["substeps"]), advance(self, *rest))[1],
    )  # fmt: skip
    sweep(repeats=3)
    assert order == [1, 2, 4] * 3


def test_time_stays_where_dt_varies(refused):
    table = sweep(vary={"dt": [0.2, 0.1, 0.05]})
    # g h t / 2 with h = dt / 10 substeps.
    np.testing.assert_allclose([r.error for r in table.rows], [0.04, 0.02, 0.01], rtol=1e-9)
    assert table.order("dt") == pytest.approx(1.0)
    with refused("vary dt must divide the simulated time, 0.4 s, got 0.3"):
        sweep(vary={"dt": [0.1, 0.3]})
    with refused("vary dt must divide"):
        sweep(vary={"dt": [0.0]})


def test_what_diverges_is_marked_and_kept():
    # omega h = 2.5 and 10: the amplitude grows by 4 and by 98 a substep, which no finer step does.
    table = sweep(
        oscillator, {"substeps": [4, 1, 8]}, error="energy", frames=1000,
        settings=EXACT.replace(dt=1.0), repeats=2,
    )  # fmt: skip
    assert [r["substeps"] for r in table.diverged] == [4, 1]
    assert all("must have a cause" in r.cause for r in table.diverged)
    assert table.fastest_stable()["substeps"] == 8
    assert str(table).count("diverged") == 2 + 2


def test_errors_beyond_the_bound_count_as_diverged():
    table = sweep(bound=0.15)
    # 10 * 0.1 * 0.4 / 2 = 0.2, 0.1, 0.05.
    assert [r.diverged for r in table.rows] == [True, False, False]
    assert table.rows[0].error == pytest.approx(0.2)
    assert "error must be at most 0.15, got 0.2" in table.rows[0].cause
    # Few frames of an explosion are still finite.
    table = sweep(
        oscillator, {"substeps": [1, 100]}, error="energy", frames=5,
        settings=EXACT.replace(dt=0.5),
    )  # fmt: skip
    assert [r.diverged for r in table.rows] == [True, False]


def test_an_error_that_is_not_finite():
    with pytest.warns(UserWarning, match="error must be finite for one setting at least, got nan"):
        table = sweep(error=lambda sim: math.nan)
    assert len(table.diverged) == 3 and "got nan at t = 0.4" in table.rows[0].cause


def test_it_starts_with_what_the_module_says():
    from particlesim.scenes import three_body

    study = Study("test", three_body.build)
    assert (study.label, study.settings, study.frames) == ("three_body", three_body.settings, 200)
    assert study.known is three_body.error and study.known_here
    assert not Study("test", three_body.build, frames=100).known_here
    study = Study("test", fall)
    assert (study.label, study.settings, study.known) == ("fall", ps.Settings(), None)


def test_memory_counts_each_array_once():
    sim = ps.Simulation(fall(count=100), EXACT, device="cpu")
    before = array_bytes(sim)
    own = sum(a.capacity for a in sim.state.arrays.values())
    # Position and velocity are kept twice, for going back; mass and the like once.
    assert own < before < 3 * own
    sim.alias = [sim.state.position, {"again": sim.state.velocity}]
    assert array_bytes(sim) == before
    table = sweep(vary={"precision": ["float32", "float64"]}, options={"count": 100})
    assert 1.5 < table.rows[1].array_bytes / table.rows[0].array_bytes <= 2
    assert all(r.particles == 100 for r in table.rows)


@pytest.mark.parametrize(
    "arguments, match",
    [
        ({"vary": {}}, "vary must be a dict of lists"),
        ({"vary": {"substeps": 3}}, "'substeps'. must be a list"),
        ({"vary": {"precision": "float32"}}, "'precision'. must be a list"),
        ({"vary": {"substeps": []}}, "'substeps'. must hold a value"),
        ({"vary": {"substeps": [0]}}, "Settings: substeps must be"),
        ({"vary": {"substps": [1]}}, "got 'substps'; did you mean 'substeps'"),
        ({"vary": {"height": ["tall"]}}, "height must be a number, got 'tall'"),
        ({"options": {"substeps": 1}}, "options must name an option of fall"),
        ({"repeats": 0}, "repeats must be"),
        ({"frames": 0}, "frames times settings.dt must be above 0"),
        ({"settings": EXACT.replace(dt=0.0)}, "settings.dt must be above 0"),
        ({"bound": -1.0}, "bound must be above 0"),
        ({"error": "known"}, "error must be another where fall has no"),
        ({"error": "entropy"}, "error must be one of known, converged, energy, momentum"),
        ({"reference": {"substeps": 9}}, "error must be 'converged' with a reference"),
        ({"error": None, "reference": np.zeros((3, 3))}, "number of particles varies .1, 3."),
        ({"error": None, "reference": {"steps": 3}}, "reference must name .* got 'steps'"),
        ({"error": None, "vary": {"count": [1, 2]}}, "reference must say which count"),
        (
            {"error": None, "vary": {"count": [1, 2]}, "reference": {"count": 1}},
            "error must be a function.*number of particles varies",
        ),
        ({"error": None, "reference": {"count": 3}}, "reference must have 1 particles"),
    ],
)  # fmt: skip
def test_bad_arguments(refused, arguments, match):
    with refused(match):
        sweep(**arguments)


def test_arguments_of_the_wrong_kind(refused):
    with refused("build must be a function", TypeError):
        sweep(ps.Scene())
    with refused("settings must be a Settings", TypeError):
        sweep(settings={"dt": 1})


# References


@pytest.mark.parametrize(
    "reference",
    [None, {"precision": "float64"}, {"substeps": 4000}, EXACT.replace(substeps=4000),
     np.array([[0.0, 1 - 5 * 0.4**2, 0.0]])],
)  # fmt: skip
def test_references(reference):
    table = sweep(error="converged", reference=reference)
    # 0.2 / substeps; the reference is itself off by a tenth of the smallest at most.
    np.testing.assert_allclose([r.error for r in table.rows], [0.2, 0.1, 0.05], atol=0.1 * 0.05)
    assert "rms distance from" in table.error
    # 100 ti in the size of what is seen: it fell by 0.8.
    assert table.bound == pytest.approx(8.0, rel=0.01)


@pytest.mark.slow
def test_a_reference_of_options():
    def attract(reach=1.0):
        scene = ps.Scene()
        scene.add_particles([(0, 0, 0), (0.9, 0, 0), (1.9, 0, 0)])
        scene.add_interaction(ps.LennardJones(cutoff=reach, sigma=0.9))
        return scene

    table = sweep(
        attract,
        {"reach": [1.5, 2.5]},
        error=None,
        reference={"reach": 2.5},
        settings=EXACT.replace(substeps=100),
    )
    # First order in h: the error of 100 substeps is small against what the cutoff leaves out.
    assert table.rows[1].error < 0.1 * table.rows[0].error


def test_distances_in_a_box_go_the_short_way():
    def drift():
        scene = ps.Scene(periodic=((0, 0, 0), (1, 1, 1)))
        scene.add_particles([(0.9, 0.5, 0.5)], velocity=(1.0, 0, 0))
        return scene

    table = sweep(drift, error=None, reference=np.array([[0.99, 0.5, 0.5]]), frames=1)
    # It is at 1.0, that is at 0.
    np.testing.assert_allclose([r.error for r in table.rows], 0.01, rtol=1e-9)


def test_a_reference_that_does_not_settle():
    rng = np.random.default_rng(0)

    def shaken():
        scene = fall()
        scene.interactions.clear()
        scene.add_interaction(ps.UniformGravity((0, rng.uniform(5, 15), 0)))
        return scene

    with pytest.warns(UserWarning, match="reference must stop changing"):
        table = sweep(shaken, error="converged")
    assert "changed by" in table.error
    # From 5 substeps it gives up after some changes of one size, before the 767 of an eighth run.
    (substeps,) = re.findall(r"a reference of (\d+) substeps", table.error)
    assert int(substeps) in (47, 95, 191, 383)


def test_a_reference_that_diverges():
    with pytest.raises(ps.SimulationError, match="the reference has diverged"):
        sweep(
            oscillator, {"substeps": [8]}, error="converged", frames=1000,
            settings=EXACT.replace(dt=1.0), reference={"substeps": 1},
        )  # fmt: skip


@pytest.mark.slow
def test_momentum_drift():
    # 10 * 0.4 of momentum, sqrt(2 K) = 4 of it: all of it comes from outside.
    table = sweep(error="momentum")
    np.testing.assert_allclose([r.error for r in table.rows], 1.0, rtol=1e-12)

    def still():
        scene = ps.Scene()
        scene.add_particles([(0, 0, 0)])
        return scene

    assert [r.error for r in sweep(still, error="momentum").rows] == [0.0] * 3
