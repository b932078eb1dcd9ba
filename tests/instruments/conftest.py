"""Fixtures of the instruments' tests."""

import pytest

from particlesim.instruments.watchdog.watch import Watchdog


@pytest.fixture
def alarms(monkeypatch):
    """How often any flag was up."""
    seen = []
    attend = Watchdog.attend
    monkeypatch.setattr(
        Watchdog,
        "attend",
        lambda self, frames: seen.append(frames.loop.frame) or attend(self, frames),
    )
    return seen
