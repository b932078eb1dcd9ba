"""What is wrong with a law is told by its own line, when a simulation is made."""

import pytest
import warp as wp

import particlesim as ps


@ps.law
def no_return(r: float):
    twice = r * 2.0  # noqa: F841, and then?


@ps.law
def no_return_in_one_case(r: float):
    if r > 1.0:
        return 2.0 * r


@ps.law
def unknown_function(r: float):
    # Comments and
    twice = 2.0 * r
    return wp.expp(twice)  # fmt: skip


@ps.law
def unknown_name(r: float):
    if r > unknown:  # noqa: F821, that is what is tested
        return 1.0
    return 2.0


@ps.law
def whole_number(r: float):
    """A text."""
    square = r * r
    return 2 * square


@ps.law
def whole_power(r: float):
    return r**2


@ps.law
def whole_result(r: float):
    return 1


@ps.law
def vector_for_number(r: float):
    return wp.vec3(r, 0.0, 0.0)


@ps.law
def helper(s: float):
    return 3 * s


@ps.law
def with_helper(r: float):
    return helper(r)


def plain(s):
    return s


@ps.law
def with_plain_function(r: float):
    return plain(r)


@ps.law
def listed(r: float):
    numbers = [1.0, 2.0]
    return numbers[0] * r


WRONG = [
    (no_return, "no_return must return a value in every case, got 'twice = r .*; end it"),
    (no_return_in_one_case, "must return a value in every case, got 'if r > 1.0:'"),
    (unknown_function, r"got 'return wp.expp\(twice\)  # fmt: skip'; .*wp.expp"),
    (unknown_name, "got 'if r > unknown:  .*define the name before.*unknown"),
    (whole_number, r"whole_number must be what Warp compiles, got 'return 2 \* square'; .*2.0"),
    (whole_power, r"got 'return r\*\*2'; .*2.0, not 2"),
    (whole_result, "whole_result must return a number, got 'return 1'; .*2.0"),
    (
        vector_for_number,
        r"return a number, got 'return wp.vec3\(r, 0.0, 0.0\)'; it returns wp.vec3",
    ),
    (with_helper, r"helper must .*got 'return 3 \* s'"),
    (with_plain_function, r"got 'return plain\(r\)'; call .*laws"),
    (listed, r"got 'numbers = \[1.0, 2.0\]'; Warp says: List"),
]


def scene_of(part):
    scene = ps.Scene()
    scene.add_particles([(0, 0, 0), (1, 0, 0)], spin=[(0, 0, 1)] * 2)
    (scene.add_interaction if isinstance(part, ps.Interaction) else scene.add_constraint)(part)
    return scene


@pytest.mark.parametrize(("law", "told"), WRONG, ids=lambda value: getattr(value, "name", ""))
def test_a_wrong_line_is_shown(law, told, precision, refused):
    settings = ps.Settings(precision=precision)
    for part in (ps.PairPotential(law, cutoff=2.0), ps.PairForce(law, cutoff=None)):
        for _ in range(2):  # nothing is kept of a law that failed
            with refused(f"{part.name}: law .*{told}"):
                ps.Simulation(scene_of(part), settings, device="cpu")


def test_what_warp_raised_is_the_cause():
    with pytest.raises(ValueError, match="expp") as caught:
        ps.Simulation(scene_of(ps.PairForce(unknown_function, cutoff=None)), device="cpu")
    assert "Error while parsing" in str(caught.value.__cause__)


def test_every_part_tells(refused):
    @ps.law
    def number(position: wp.vec3):
        return 2 * position[0]

    @ps.law
    def flat(position: wp.vec3):
        return position[0]

    @ps.law
    def link(a: wp.vec3, b: wp.vec3):
        return 2 * wp.length(b - a)

    @ps.law
    def wall(x: wp.vec3):
        return x

    @ps.law
    def summed(mass_j: float) -> wp.vec3:
        return mass_j

    class Own(ps.Interaction):
        def prepare(self, model, neighbors):
            self.sum = ps.PairSum(self, model, neighbors, summed)

    @ps.law
    def pressure(density: float):
        return 2 * density

    state = ps.EquationOfState()
    state.pressure = state.energy = state.sound_speed = pressure
    for part, told in (
        (ps.ParticleForce(number), "ParticleForce: law number must be what Warp compiles"),
        (ps.ParticleForce(flat), r"law flat must return wp.vec3, got 'return position\[0\]'"),
        (ps.ParticleForce(potential=number), "law number must be what Warp compiles"),
        (ps.Constraint(link, particles=[(0, 1)]), "Constraint: law link must be what Warp"),
        (ps.Boundary(wall), "Boundary: law wall must return a number"),
        (Own(), "Own.PairSum: law summed must return wp.vec3, got 'return mass_j'"),
        (ps.SPH(smoothing_length=0.1, equation_of_state=state), "law pressure must be what Warp"),
    ):
        with refused(told):
            ps.Simulation(scene_of(part), device="cpu")


def test_parameters_of_another_type(refused):
    @ps.law
    def number(velocity):
        return wp.vec3(velocity, 0.0, 0.0)

    @ps.law
    def vector(mass: wp.vec3):
        return mass

    @ps.law
    def spin(r: float, spin_i: float, spin_j: float):
        return spin_i * spin_j * r

    @ps.law
    def given(position: wp.vec3, direction: wp.vec3, size: float):
        return size * direction

    for part, told in (
        (ps.ParticleForce(number), "law number must take velocity as wp.vec3, got 'float'; write"),
        (ps.ParticleForce(vector), "law vector must take mass as float, got 'wp.vec3'"),
        (ps.PairForce(spin, cutoff=None), "law spin must take spin_i as wp.vec3, got 'float'"),
    ):
        with refused(told):
            ps.Simulation(scene_of(part), device="cpu")
    with refused(r"direction must have shape \(3,\), got 1.0"):
        ps.ParticleForce(given, direction=1.0, size=1.0)
    with refused(r"size must be a number, as given takes it, got \(1, 0, 0\); .*size: wp.vec3"):
        ps.ParticleForce(given, direction=(1, 0, 0), size=(1, 0, 0))
