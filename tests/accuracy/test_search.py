"""The search for the cheapest settings, on errors and costs that are made up."""

import pytest

import particlesim as ps
from particlesim.accuracy.tune.report import Trial
from particlesim.accuracy.tune.search import Search, levels


class Paper:
    """A bench on paper: error = (scale / substeps)^order + floor."""

    def __init__(self, laws):
        self.laws, self.trials = laws, []

    def trial(self, values):
        scale, order, floor, _ = self.laws[values["integrator"]]
        error = (scale / values["substeps"]) ** order + floor
        made = Trial(dict(values), ps.Settings(), {}, error, self.cost(values))
        if all(made.values != each.values for each in self.trials):
            self.trials.append(made)
        return made

    def cost(self, values):
        return values["substeps"] * self.laws[values["integrator"]][3]

    def costs(self, chosen, repeats):
        return [self.cost(values) for values in chosen]


EULER, VERLET = "symplectic_euler", "velocity_verlet"


def search(laws, target, start=10, most=100000, least=1):
    bench = Paper(laws)
    found = Search(bench, target, {"integrator": list(laws)}, levels(least, most))
    return found.run(start), bench.trials


@pytest.mark.parametrize("target", [0.3, 1e-2, 1e-3])
@pytest.mark.parametrize("start", [1, 10, 3000])
def test_least_substeps_of_one_mode(target, start):
    best, trials = search({EULER: (1.0, 1, 0.0, 1.0)}, target, start)
    # Levels are a tenth apart, or one, and the least that suffices is bracketed to one of them.
    assert 1 / target <= best.values["substeps"] <= 1.21 / target + 1
    assert len(trials) <= 10


def test_order_decides_where_to_start():
    laws = {EULER: (1.0, 1, 0.0, 1.0), VERLET: (1.0, 2, 0.0, 1.1)}
    best, trials = search(laws, 1e-6, most=10**7)
    assert best.values["integrator"] == VERLET
    assert 1000 <= best.values["substeps"] <= 1210
    assert max(trial.cost for trial in trials) < 5000  # not the 10^6 that Euler needs


def test_a_mode_that_is_dominated_costs_one_trial():
    laws = {VERLET: (1.0, 2, 0.0, 1.0), EULER: (1.0, 1, 0.0, 0.9)}
    _, trials = search(laws, 1e-4)
    assert sum(trial.values["integrator"] == EULER for trial in trials) <= 3


def test_a_floor_above_the_target_is_seen():
    best, trials = search({EULER: (1.0, 1, 0.1, 1.0)}, 0.01)
    assert best is None and len(trials) < 8
    best, _ = search({EULER: (1.0, 1, 0.1, 1.0), VERLET: (50.0, 2, 0.0, 9.0)}, 0.01)
    assert best.values["integrator"] == VERLET and 500 <= best.values["substeps"] <= 605


def test_never_below_the_least_nor_above_the_most():
    best, trials = search({EULER: (1.0, 1, 0.0, 1.0)}, 0.5, least=40)
    assert best.values["substeps"] == 40
    assert min(trial.values["substeps"] for trial in trials) == 40
    best, trials = search({EULER: (1e9, 1, 0.0, 1.0)}, 0.5, most=100)
    assert best is None and max(trial.values["substeps"] for trial in trials) <= 110


def test_levels():
    assert levels(1, 12) == [*range(1, 13)]
    assert levels(100, 150) == [100, 110, 121, 133, 146, 161]
