"""The fast ways are given up, with one warning, where Warp does not do what they rest on."""

import re
import warnings
from types import SimpleNamespace

import numpy as np
import pytest

import particlesim as ps
from particlesim.engine.execution.threads import Team
from particlesim.engine.model import Model
from particlesim.kernels import native, self_check
from particlesim.kernels.engine import packed
from particlesim.kernels.engine.neighbors import partners
from particlesim.kernels.interactions import pair
from particlesim.kernels.warp_internals import Packed, elements


def no_points(monkeypatch):
    """A wrong result: of each mask of hits the lanes are others."""
    monkeypatch.setattr(partners, "_lanes", lambda mask: 0)


def another_term(monkeypatch):
    """A wrong result: positions that lie in another order in memory."""

    def shifted(array, c):
        return f"({elements(array, c)} + {int(array == 'd.x')})"

    monkeypatch.setattr(native, "elements", shifted)


def no_such_name(monkeypatch):
    """An exception: native code does not find the law by its name, and does not compile."""
    monkeypatch.setattr(packed, "native_name", lambda function: "no_such_function")


def not_loaded(monkeypatch):
    """No entry point."""

    class Unloaded(Packed):
        def __init__(self, command):
            command.hooks = SimpleNamespace(forward=None)
            super().__init__(command)

    monkeypatch.setattr(self_check, "Packed", Unloaded)


CHANGES = {
    no_points: "not ", another_term: "not ", no_such_name: "Error|Exception",
    not_loaded: "must have an entry point, got none",
}  # fmt: skip


@pytest.fixture
def unchecked():
    """A process that has not looked yet, before and after."""

    forget()
    yield
    forget()


def forget():
    """As if nothing had been made or tried."""
    self_check.fast_ways.cache_clear()
    self_check._kernel.cache_clear()
    partners.partners_kernel.cache_clear()
    pair._KERNELS.clear()


def melt(liquid, execution="threads"):
    settings = ps.Settings(
        dt=0.01, substeps=2, precision="float64", execution=execution, threads=3
    )  # fmt: skip
    sim = ps.Simulation(liquid(cells=6), settings, device="cpu")
    sim.run(2)
    return sim


def test_here_the_fast_ways_do_what_they_are_to_do(unchecked):
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert self_check.fast_ways()


@pytest.mark.parametrize("change", CHANGES)
def test_a_changed_warp_is_run_by_its_own_ways(change, unchecked, monkeypatch, liquid):
    with monkeypatch.context() as patch:
        patch.setattr(Model, "vectorised", False)
        plain = melt(liquid, "graph")
    fast = melt(liquid)
    forget()
    change(monkeypatch)
    with pytest.warns(RuntimeWarning, match="native loops and packed launches fail") as told:
        sims = [melt(liquid) for _ in range(2)]
    (warning,) = [each for each in told if each.category is RuntimeWarning]
    assert re.search(CHANGES[change], str(warning.message))
    for sim in sims:
        assert not sim.model.vectorised
        assert not sim.executor.chosen.team.workers
        np.testing.assert_array_equal(sim.position, plain.position)
        # Sums in another order: round-off, which a liquid multiplies by a few in four substeps.
        np.testing.assert_allclose(sim.position, fast.position, rtol=0, atol=1e-12)


def test_a_team_without_native_code_runs_everything_itself(monkeypatch, liquid):
    monkeypatch.setattr("particlesim.engine.execution.threads.fast_ways", lambda: False)
    assert not Team(3).workers
    np.testing.assert_array_equal(melt(liquid).position, melt(liquid, "graph").position)
