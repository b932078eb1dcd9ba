"""Settings: the knobs of speed and accuracy."""

import dataclasses

import pytest

import particlesim as ps


def test_a_changed_copy():
    settings = ps.Settings(dt=0.1, substeps=4)
    finer = settings.replace(substeps=8, precision="float64")
    assert (finer.dt, finer.substeps, finer.precision) == (0.1, 8, "float64")
    assert settings.substeps == 4
    assert finer.substep == pytest.approx(0.0125, rel=1e-15)


def test_frozen_and_comparable():
    settings = ps.Settings()
    with pytest.raises(dataclasses.FrozenInstanceError):
        settings.dt = 1.0
    assert settings == ps.Settings()
    assert hash(settings) == hash(ps.Settings())


def test_knobs_are_given_by_name():
    with pytest.raises(TypeError):
        ps.Settings(0.1)


@pytest.mark.parametrize("make", [ps.Settings, ps.Settings().replace])
def test_an_unknown_knob_lists_the_known_ones(make, refused):
    with refused("did you mean 'substeps'", kind=TypeError) as _:
        make(subsetps=3)
    with pytest.raises(TypeError) as caught:
        make(colour="red")
    for field in dataclasses.fields(ps.Settings):
        assert field.name in str(caught.value)


@pytest.mark.parametrize(
    ("knob", "values"),
    [
        ("dt", [-1.0, float("nan"), float("inf"), "fast", None]),
        ("substeps", [0, -3, 1.5, True, "ten"]),
        ("most_substeps", [0, 9, 1.5, "many"]),
        ("iterations", [0, 2.0]),
        ("integrator", ["euler", None]),
        ("precision", ["float16", 64]),
        ("execution", ["gpu"]),
        ("skin", [-0.1, float("nan")]),
        ("opening_angle", [-0.1, 1.1, float("nan"), "wide"]),
        ("relaxation", [0.0, 2.5, float("nan")]),
        ("depenetration_speed", [0.0, -1.0, float("inf")]),
        ("threads", [0, 1.5]),
        ("compensated", [1, "yes", None]),
    ],
)
def test_values_out_of_range(knob, values, refused):
    for value in values:
        with refused(f"Settings: {knob} must"):
            ps.Settings(**{knob: value})


def test_adaptive_substeps_have_a_maximum():
    settings = ps.Settings(substeps="adaptive")
    assert settings.automatic and settings.adaptive and settings.most_substeps == 10_000
    assert not settings.replace(substeps=20).automatic and settings.replace(substeps=20).adaptive
    assert not ps.Settings().adaptive
    with pytest.raises(ValueError, match="dt must be a number"):
        ps.Settings(dt="adaptive")
    with pytest.raises(ValueError, match='be a number with dt="auto"'):
        ps.Settings(dt="auto", substeps="adaptive")


def test_choices_are_listed(refused):
    with refused(
        "must be one of symplectic_euler, velocity_verlet, yoshida4, yoshida6, got 'leapfrog'"
    ):
        ps.Settings(integrator="leapfrog")
