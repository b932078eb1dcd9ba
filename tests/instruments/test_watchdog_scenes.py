"""The watchdog: no false alarms, what an audit costs, and its knobs."""

import pytest

import particlesim as ps
from cases.ready import small
from cases.watchdog import falling, quietly
from particlesim.engine.frames import Frames
from particlesim.instruments.watchdog.trace import REFINEMENTS

# False alarms -----------------------------------------------------------------------------------


@pytest.mark.parametrize("name", ["dam_break", "star_collision", "gas_in_a_box", "triple_pendulum",
                                  "three_body", "pile", "chain", "spring_lattice"])  # fmt: skip
def test_ready_scenes_raise_no_alarm(name, device, alarms):
    module, scene = small(name)
    sim = ps.Simulation(scene, module.settings, device=device)
    for _ in range(12):
        sim.step()
    assert not alarms


def test_an_audit_costs_three_refinements(device, monkeypatch):
    done = []
    peaks = Frames.peaks
    monkeypatch.setattr(
        Frames, "peaks",
        lambda self, substeps: done.append(substeps) or peaks(self, substeps),
    )  # fmt: skip
    scene, settings = falling()
    sim = ps.Simulation(scene, settings.replace(energy_growth=1.5), device=device)
    quietly(sim, 3)
    assert sim.incidents == []
    assert done[:3] == [settings.substeps * each for each in REFINEMENTS]


def test_knobs_are_checked(refused):
    for knob, wrong in (
        ("watchdog", 1), ("on_failure", "ignore"), ("retries", 0), ("energy_growth", 1.0),
        ("ledger", None),
    ):  # fmt: skip
        with refused(f"Settings: {knob} must"):
            ps.Settings(**{knob: wrong})
