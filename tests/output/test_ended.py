"""Runs that are asked to end, by SIGTERM or Ctrl+C: trimmed, with a checkpoint, and a word."""

import contextlib
import os
import random
import re
import shutil
import signal
import subprocess
import sys
import threading
import time

import numpy as np
import pytest
from pxr import Sdf

from particlesim.output.interrupts import Deferred, Terminated, heard, terminable
from particlesim.simulation.resume import checkpoint_path

from .runs import assert_same_root, frames_of, sim

SCENE = """
import particlesim as ps
settings = ps.Settings(dt=1 / 60, substeps=4)
frames = 60
def build():
    scene = ps.Scene()
    x = ps.sample.box((0, 0.5, 0), (0.5, 1, 0.5), spacing=0.1)
    scene.add_particles(x, radius=0.05, velocity=(1, 0, 0))
    scene.add_interaction(ps.UniformGravity())
    scene.add_constraint(ps.Contact(friction=0.3))
    scene.add_constraint(ps.PlaneBoundary((0, 0, 0), (0, 1, 0)))
    return scene
"""


@pytest.fixture
def scene(tmp_path):
    path = tmp_path / "scene.py"
    path.write_text(SCENE)
    return path


def start(*words):
    program = [sys.executable, "-m", "particlesim.cli", "run", *map(str, words)]
    # Whoever started the tests may have these ignored.
    return subprocess.Popen(
        program, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.default_int_handler),
    )  # fmt: skip


@pytest.mark.slow
def test_a_terminated_run_is_trimmed_and_goes_on(scene, tmp_path):
    terminate_at_random(scene, tmp_path, 3)


@pytest.mark.slow
def test_a_terminated_run_is_trimmed_and_goes_on_every_time(scene, tmp_path):
    terminate_at_random(scene, tmp_path, 20)


def terminate_at_random(scene, folder, tries):
    (folder / "whole").mkdir()
    whole = folder / "whole" / "out.usda"
    words = [scene, "--device", "cpu", "--frames", "2000", "--every", "10"]
    began = time.perf_counter()
    assert start(*words, "--out", whole).wait(timeout=100) == 0
    lasts = time.perf_counter() - began
    reference, rng = frames_of(whole), random.Random(3)
    for k in range(tries):
        (folder / str(k)).mkdir()
        out = folder / str(k) / "out.usda"
        process = start(*words, "--out", out)
        # A run that is over, on a machine that has become faster, is started again.
        time.sleep(rng.uniform(0.4 if k < 3 else 0.0, 0.9) * lasts)
        while process.poll() is not None:
            process.communicate()
            shutil.rmtree(out.parent)
            out.parent.mkdir()
            process = start(*words, "--out", out)
            time.sleep(rng.uniform(0.0, 0.5) * lasts)
        process.terminate()
        _, said = process.communicate(timeout=60)
        assert process.returncode in (143, -signal.SIGTERM), said  # the latter: not yet in main
        if process.returncode == 143:
            assert re.fullmatch(r"error: terminated after \d+ of \d+ frames\n", said), said
        if process.returncode == 143 and out.exists():
            frames = int(said.split()[3])
            found = frames_of(out)
            assert len(found) == frames // 10 + 1
            assert all(content == reference[name] for name, content in found.items())
            assert Sdf.Layer.OpenAsAnonymous(str(out)).endTimeCode == len(found) - 1
            with np.load(checkpoint_path(out)) as file:
                assert f'"frame": {frames},' in file["header"].tobytes().decode()
        assert not out.with_suffix(".lock").exists() or process.returncode != 143
        assert start(*words, "--out", out, "--resume").wait(timeout=100) == 0
        assert frames_of(out) == reference
        assert_same_root(out, whole)


@pytest.mark.parametrize(
    ("number", "kind"), [(signal.SIGTERM, Terminated), (signal.SIGINT, KeyboardInterrupt)]
)
def test_a_run_in_python_ends_after_its_frame(suffix, tmp_path, number, kind):
    path, stopped = tmp_path / f"out{suffix}", sim()

    def ask(done, frames):
        if done == 4:
            os.kill(os.getpid(), number)
            time.sleep(0.01)

    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    try:
        with pytest.raises(kind) as caught:
            stopped.run(9, record=path, progress=ask)
    finally:
        signal.signal(signal.SIGINT, before)
    assert stopped.frame == 4 and len(frames_of(path)) == 5
    if kind is Terminated:
        assert caught.value.code == 143
    resumed, seen = sim(), []
    resumed.run(9, record=path, resume=True, progress=lambda k, n: seen.append(k))
    assert seen == [5, 6, 7, 8, 9]  # from where it was asked to end


def test_what_is_deferred_comes_once():
    seen = []
    before = signal.signal(signal.SIGINT, lambda *_: seen.append("handler"))
    try:
        with pytest.raises(Terminated), terminable(), Deferred() as outer:
            with Deferred() as inner:
                signal.raise_signal(signal.SIGTERM)
                inner.check()  # the outer one keeps it
            outer.check()
        assert outer.acted and signal.getsignal(signal.SIGTERM) is signal.SIG_DFL
        with Deferred() as outer:
            signal.raise_signal(signal.SIGINT)
            assert not seen
            outer.check()
            assert seen == ["handler"] and not outer.acted  # it goes on
            signal.raise_signal(signal.SIGINT)
            signal.raise_signal(signal.SIGINT)  # impatient
            assert seen == ["handler"] * 2
        assert seen == ["handler"] * 3
        with pytest.raises(KeyError), Deferred():
            signal.raise_signal(signal.SIGINT)
            raise KeyError("the first error is the one to see")
    finally:
        signal.signal(signal.SIGINT, before)


def test_threads_have_no_handlers():
    failed = []

    def work():
        try:
            with terminable(), Deferred() as interrupts:
                interrupts.check()
        except BaseException as error:
            failed.append(error)

    thread = threading.Thread(target=work)
    thread.start()
    thread.join()
    assert not failed


def test_an_interrupt_while_usd_is_imported_is_not_swallowed():
    program = """
import os, signal, sys, threading
class Interrupt:
    def find_spec(self, name, *_):
        if name == "pxr.Gf":
            os.kill(os.getpid(), signal.SIGINT)
signal.signal(signal.SIGINT, signal.default_int_handler)
sys.meta_path.insert(0, Interrupt())
import particlesim.output.usd
"""
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True)
    assert done.returncode == -signal.SIGINT and "Error loading" not in done.stderr
    assert done.stderr.strip().endswith("KeyboardInterrupt")


class Dying:
    """Ends while a signal comes."""

    def __init__(self, number):
        self.number = number

    def __del__(self):
        signal.raise_signal(self.number)


@pytest.mark.parametrize(
    ("number", "kind"), [(signal.SIGTERM, Terminated), (signal.SIGINT, KeyboardInterrupt)]
)
@pytest.mark.filterwarnings("error")
def test_what_a_library_swallows_comes_again(number, kind, capsys):
    """At the next look of a run, or at the end of a program that does not look."""

    def load():
        with contextlib.suppress(BaseException):
            signal.raise_signal(number)

    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    try:
        reached = []
        with pytest.raises(kind), terminable():
            load()
            with Deferred() as ends:
                reached.append("a frame")
                ends.check()
                reached.append("another")
        with pytest.raises(kind), terminable():
            load()
            reached.append("the end")
        with pytest.raises(kind), terminable():
            kept = Dying(number)
            del kept  # Python says what it ignores
            reached.append("the end again")
        assert reached == ["a frame", "the end", "the end again"]
        assert not capsys.readouterr().err
        with terminable():
            load()
            heard()
        with terminable(), Deferred() as ends:
            ends.check()  # it is forgotten
        assert signal.getsignal(signal.SIGTERM) is signal.SIG_DFL
    finally:
        signal.signal(signal.SIGINT, before)
