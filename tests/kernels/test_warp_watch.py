"""All that is asked of Warp passes the doors that are watched."""

import threading

import numpy as np
import pytest
import warp as wp

from particlesim.kernels.warp_internals import doors
from particlesim.kernels.warp_watch import watched

LAUNCH, COPY = wp.launch, wp.copy  # as a program has them that imports them by name


@wp.kernel
def one(values: wp.array(dtype=float)):
    values[wp.tid()] = 1.0


class Told:
    """Whom all is told; it has nothing done that can wait."""

    def __init__(self):
        self.heard = []

    def launch(self, arguments):
        self.heard.append(("launch", arguments["dim"]))

    def call(self, run):
        self.heard.append(("call", run))

    def host(self, what):
        self.heard.append(("host", what))


@pytest.fixture
def array():
    return wp.zeros(4, dtype=float, device="cpu")


def grid(array):
    wp.HashGrid(4, 4, 4, device="cpu").build(wp.zeros(4, dtype=wp.vec3, device="cpu"), 1.0)


ASKED = {
    "launch": lambda a: wp.launch(one, 4, [a], device="cpu"),
    "call": lambda a: wp.copy(a, wp.empty(4, dtype=float, device="cpu")),
    "call zero": lambda a: a.zero_(),
    "call fill": lambda a: a.fill_(2.0),
    "call assign": lambda a: a.assign(wp.empty(4, dtype=float, device="cpu")),
    "call zeros": lambda a: wp.zeros(4, dtype=float, device="cpu"),
    "host numpy": lambda a: a.numpy(),
    "host asarray": lambda a: np.asarray(a),
    "host list": lambda a: a.list(),
    "host data": lambda a: wp.array([1.0], dtype=float, device="cpu"),
    "host assign": lambda a: a.assign(np.ones(4)),
    "host grid": grid,
    "host scan": lambda a: wp.utils.array_scan(a, wp.empty_like(a)),
    "host by name": lambda a: LAUNCH(one, 4, [a], device="cpu"),
    "host copy by name": lambda a: COPY(a, wp.empty(4, dtype=float, device="cpu")),
    "host command": lambda a: wp.launch(one, 4, [a], device="cpu", record_cmd=True).launch(),
}


@pytest.mark.parametrize("what", ASKED)
def test_everything_is_told(what, array):
    told = Told()
    with watched(told):
        ASKED[what](array)
    assert what.partition(" ")[0] in {kind for kind, _ in told.heard}
    if not what.startswith("host"):
        assert (array.numpy() == 0.0).all()  # it waits
    told.heard.clear()
    ASKED[what](array)
    assert not told.heard


def test_another_thread_is_not_told_of(array):
    told = Told()

    def launch():
        wp.launch(one, 4, [array], device="cpu")

    with watched(told):
        thread = threading.Thread(target=launch)
        thread.start()
        thread.join()
    assert not told.heard
    assert (array.numpy() == 1.0).all()


def test_the_doors_are_put_back():
    def now():
        return [vars(owner)[name] for owner, name, _ in doors()]

    before = now()
    with watched(Told()), watched(None):
        assert not any(a is b for a, b in zip(now(), before, strict=True))
    assert all(a is b for a, b in zip(now(), before, strict=True))
