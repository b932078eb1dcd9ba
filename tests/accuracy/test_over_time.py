"""Errors over time: what is compared, when, and over whom."""

import math

import numpy as np
import pytest
import warp as wp

import particlesim as ps
from cases.closed_forms import EXACT, along, harmonic, off_harmonic, two_turns
from particlesim.accuracy.observables import READY

FRAMES = 24
STEPS = [2, 4, 8, 16]


def sweep(build=harmonic, vary=None, **arguments):
    arguments = {
        "frames": FRAMES, "settings": two_turns(), "repeats": 1, "device": "cpu", **arguments,
    }  # fmt: skip
    return ps.tradeoff(build, vary or {"substeps": STEPS}, **arguments)


def verlet(substeps, frame):
    """Velocity Verlet's own cos: of an angle arccos(1 - h^2/2) a step, exactly."""
    h = two_turns().dt / substeps
    return math.cos(frame * substeps * math.acos(1 - h * h / 2))


def misses(substeps):
    """How far Verlet's oscillator is from cos t at each frame."""
    exact = [math.cos(frame * two_turns().dt) for frame in range(1, FRAMES + 1)]
    return np.array([verlet(substeps, k + 1) - x for k, x in enumerate(exact)])


OVER = {
    "final": lambda d: abs(d[-1]),
    "max": lambda d: np.abs(d).max(),
    "rms": lambda d: np.sqrt((d**2).mean()),
    "mean": lambda d: abs(d.mean()),
}


@pytest.mark.parametrize("over", OVER)
@pytest.mark.parametrize("observe", [lambda sim: sim.position[0, 0], None])
def test_what_is_observed_over_time(over, observe):
    table = sweep(observe=observe, over=over)
    # The reference may be off by a tenth of the smallest error.
    wanted = [OVER[over](misses(n)) for n in STEPS]
    found = [row.error for row in table.rows]
    np.testing.assert_allclose(found, wanted, rtol=1e-6, atol=0.11 * min(wanted))


@pytest.mark.parametrize("over", OVER)
def test_a_known_answer_over_time(over):
    table = sweep(error=off_harmonic, over=over)
    # Of round-off of a hundred steps.
    wanted = [OVER[over](misses(n)) for n in STEPS]
    np.testing.assert_allclose([row.error for row in table.rows], wanted, rtol=1e-9, atol=1e-13)


def test_an_error_that_passes_through_zero_does_not_look_small():
    at_end, over_time = sweep(error=off_harmonic), sweep()
    # After two whole periods cos is flat: the error is the phase's squared, and of fourth order.
    assert at_end.order("substeps") == pytest.approx(4.0, abs=0.1)
    assert over_time.order("substeps") == pytest.approx(2.0, abs=0.1)
    assert over_time.rows[-1].error > 20 * at_end.rows[-1].error


def test_the_scale_is_stated():
    table = sweep()
    # It goes from 1 to -1, to the reference's own error.
    assert table.scale == pytest.approx(2.0, rel=1e-3)
    for row in table.rows:
        assert row.relative == row.error / table.scale
    assert "relative: over 2, the largest change" in str(table)


@pytest.mark.parametrize("held", [1, 100, 10_000])
def test_who_is_held_does_not_make_it_accurate(held):
    alone, beside = (
        sweep(vary={"substeps": [4]}, reference={"substeps": 400}, options={"held": n})
        for n in (0, held)
    )
    assert beside.rows[0].error == alone.rows[0].error
    assert beside.rows[0].parts == alone.rows[0].parts


def test_worst_and_velocity():
    def two():
        scene = harmonic()
        scene.add_particles([(0, 3, 0)], velocity=(1, 0, 0))
        return scene

    row = sweep(two, {"substeps": [4]}, reference={"substeps": 4000}).rows[0]
    # The other flies straight, without an error: rms over both is 1 / sqrt(2) of the worst.
    assert row.parts["worst"] == pytest.approx(np.abs(misses(4)).max(), rel=1e-4)
    assert row.error == pytest.approx(row.parts["worst"] / math.sqrt(2), rel=1e-6)
    # Verlet's velocity is -sqrt(1 - h^2/4) sin of the same angle.
    h, t = two_turns().dt / 4, two_turns().dt * np.arange(1, FRAMES + 1)
    v = -math.sqrt(1 - h * h / 4) * np.sin(4 * np.arange(1, FRAMES + 1) * math.acos(1 - h * h / 2))
    largest = np.abs(v + np.sin(t)).max() / math.sqrt(2)
    assert row.parts["velocity"] == pytest.approx(largest, rel=1e-4)


def test_a_table_is_saved_with_what_each_row_has(tmp_path):
    # The first diverges, and has no worst particle: omega h = 2.6.
    table = sweep(vary={"substeps": [1, 8]}, settings=two_turns(frames=24, dt=2.6), frames=40)
    assert table.rows[0].diverged and not table.rows[1].diverged
    for name in ("a.csv", "a.json"):
        table.save(tmp_path / name)
    assert "worst_error" in (tmp_path / "a.csv").read_text()
    assert '"errors": [' in (tmp_path / "a.json").read_text()
    table.plot(tmp_path / "a.png")


def test_values_of_any_shape():
    table = sweep(
        vary={"substeps": [4]}, observe=lambda sim: np.outer(sim.position[0], [1.0, 1.0]),
        reference={"substeps": 4000},
    )  # fmt: skip
    # rms over six values of which two differ.
    assert table.rows[0].error == pytest.approx(np.abs(misses(4)).max() / math.sqrt(3), rel=1e-4)


def test_ready_observables():
    for name in ("velocity", "energy", "temperature", "momentum", "angular_momentum"):
        table = sweep(vary={"substeps": [4, 8]}, observe=name, reference={"substeps": 200})
        assert f"difference of {name}" in table.error and table.rows[0].error < 0.1


def test_where_dt_varies_only_shared_times_are_compared():
    dt = two_turns().dt
    table = sweep(vary={"dt": [4 * dt, 2 * dt, dt]}, settings=two_turns(substeps=40))
    assert table.order("dt") == pytest.approx(2.0, abs=0.02)


def test_drift_over_time():
    finals, largest = (
        [row.error for row in sweep(error="energy", over=over).rows] for over in ("final", "max")
    )
    # Verlet's energy swings with the phase, which has come back to where it was.
    assert all(low < 0.1 * high for low, high in zip(finals, largest, strict=True))


@pytest.mark.parametrize(
    "arguments, match",
    [
        ({"over": "last"}, "over must be one of final, max, rms, mean"),
        ({"observe": "speed"}, "observe must be one of position, velocity"),
        ({"observe": "energy", "error": "momentum"}, "error must be left out, or 'converged'"),
        ({"over": "max", "reference": np.zeros((1, 3))}, "over must be 'final'"),
        ({"seeds": 3}, "seeds must be of a build with an option seed, a whole number"),
    ],
)
def test_bad_arguments(refused, arguments, match):
    with refused(match):
        sweep(**arguments)


def test_what_is_observed_must_be_a_function(refused):
    with refused("observe must be a function", TypeError):
        sweep(observe=3.0)


# References


@ps.law
def pulse(time: float, at: float, width: float, push: float):
    return wp.vec3(wp.where(wp.abs(time - at) < 0.5 * width, push, 0.0), 0.0, 0.0)


def kicked(at=0.123456, width=1e-5):
    """A push of 10 N s that nobody sees who looks at 480 times a second."""
    scene = harmonic()
    scene.add_interaction(ps.ParticleForce(pulse, at=at, width=width, push=10.0 / width))
    return scene


@pytest.mark.parametrize("at", [0.123456, 0.765432])
def test_a_push_between_all_samples_is_seen(refused, at):
    settings = ps.Settings(dt=1 / 60, **EXACT)
    with pytest.warns(UserWarning, match="a law of time acts between their substeps"):
        table = sweep(
            kicked, {"substeps": [1, 2, 4, 8]}, settings=settings, frames=60, options={"at": at}
        )
    # 10 sin(1 - at) at the end; of a look every 4 us, which sees the push to a sample of 2.6.
    assert all(row.error > 0.5 * 10 * math.sin(1 - at) for row in table.rows)
    assert "error does not fall with substeps" in str(table) and table.orders() == {}
    with refused("error must be at least .* by which the reference may be off"):
        table.cheapest(error=1e-3)
    with refused("reference must be known to 0.0001, a tenth of the tolerance"):
        ps.tune(kicked, 1e-3, settings=settings, frames=60, options={"at": at}, device="cpu")


def test_a_law_of_time_that_is_resolved_is_not_refused():
    settings = ps.Settings(dt=1 / 60, **EXACT)
    table = sweep(
        kicked, {"substeps": [8, 16, 32]}, settings=settings, frames=60, options={"width": 0.25}
    )
    # Its edges lie between substeps, so that it is of first order, more or less.
    assert table.rows[-1].error < 0.05 and table.floor < table.rows[-1].error


def waves(spacing=0.1, lag=0.0):
    """Particles along a line, whose mean of squares misses that of the line by spacing^2 / 12."""
    scene = ps.Scene()
    x = np.arange(spacing / 2, 1.0, spacing)
    scene.add_particles(np.stack([x, 0 * x, 0 * x], axis=1), velocity=(0, 1, 0))
    return scene


def test_a_reference_is_finer_in_space_where_space_varies():
    table = sweep(
        waves, {"spacing": [0.2, 0.1, 0.05]}, frames=2, settings=ps.Settings(dt=0.1),
        observe=lambda sim: (sim.position[:, 0] ** 2).mean(),
    )  # fmt: skip
    assert "in time and space, to spacing=0.03125" in table.error
    law = [(h**2 - (0.05 / 1.6) ** 2) / 12 for h in (0.2, 0.1, 0.05)]
    np.testing.assert_allclose([row.error for row in table.rows], law, rtol=1e-3)
    # What is left of space is the difference of its last two.
    left = ((0.05 / 1.25) ** 2 - (0.05 / 1.6) ** 2) / 12
    assert table.floor == pytest.approx(left, rel=1e-3)


def test_the_oscillator_that_is_compared_with():
    found = along(harmonic, two_turns(substeps=4), FRAMES, off_harmonic)
    np.testing.assert_allclose(found, np.abs(misses(4)), atol=1e-13)


def test_of_what_stays_coarse_the_table_says_so():
    table = sweep(waves, {"substeps": [1, 2]}, frames=2, settings=ps.Settings(dt=0.1))
    assert "of time only, spacing stays as it is" in table.error


def test_a_reference_does_not_share_the_integrator_of_what_is_judged():
    class Slow(ps.Integrator):
        """Drifts a hundredth too little, at any step."""

        def advance(self, dt):
            self.move(dt, 0.99 * dt)

    table = sweep(settings=two_turns(integrator=Slow), vary={"substeps": [50, 100, 200]})
    # omega^2 is 0.99, however fine; the rest is of first order, a phase of h / 2.
    t = two_turns().dt * np.arange(1, FRAMES + 1)
    wanted = np.abs(np.cos(math.sqrt(0.99) * t) - np.cos(t)).max()
    for row in table.rows:
        assert row.error == pytest.approx(wanted, abs=0.6 * row.settings.substep)


def test_temperature_and_pressure(refused):
    scene = ps.Scene(periodic=((0, 0, 0), (2, 2, 2)))
    scene.add_particles([(0, 0, 0), (1, 1, 1)], velocity=[(3, 0, 0), (0, 4, 0)])
    sim = ps.Simulation(scene, device="cpu")
    # 2 K = 25 of two particles in a volume of 8, which do not feel each other.
    assert READY["temperature"](sim) == pytest.approx(25 / 6)
    assert READY["pressure"](sim) == pytest.approx(25 / 24)
    with refused("pressure must be of a scene that is periodic on all axes"):
        READY["pressure"](ps.Simulation(harmonic(), device="cpu"))
