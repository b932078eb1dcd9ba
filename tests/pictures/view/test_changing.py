"""The live view of files that change or are broken, and of scenes that run."""

import os
import shutil

import numpy as np
import pytest

from particlesim.output.usd.recorder import UsdRecorder
from particlesim.pictures.view.footage import Footage
from particlesim.pictures.view.live import Live
from particlesim.pictures.view.server import Server

from .drops import DROPS, FRAMES, WORLDS, get, packet, refusal, simulation, wait_for


def copied(recorded, folder):
    path = shutil.copy(recorded[0], folder)
    shutil.copytree(recorded[0].with_suffix(".clips"), folder / "drops.clips")
    return folder / os.path.basename(path)


@pytest.mark.parametrize("broken", [0, 3])
def test_a_truncated_frame_says_so_and_the_others_are_there(recorded, tmp_path, broken):
    path = copied(recorded, tmp_path)
    clip = path.with_suffix(".clips") / f"f.{broken:06d}.usdc"
    clip.write_bytes(clip.read_bytes()[:700])
    with Server(Footage(path)) as server:
        assert get(server, "/scene")["frames"] == list(range(FRAMES + 1))
        for _ in range(2):
            message = refusal(server, f"/frame/{broken}", 400)
            assert f"frame {broken} must have a file that can be read to its end" in message
            assert clip.name in message
        assert "boundary.veil" in packet(server, "/still")[1]
        get(server, "/span?color=speed")
        _, arrays = packet(server, "/frame/4?apart=1")
        assert len(arrays["thing.ball"]) == WORLDS * (DROPS + 2)


def test_a_missing_frame_is_none(recorded, tmp_path):
    path = copied(recorded, tmp_path)
    (path.with_suffix(".clips") / "f.000002.usdc").unlink()
    with Server(Footage(path)) as server:
        assert get(server, "/scene")["frames"] == [0, 1, 3, 4, 5, 6]
        refusal(server, "/frame/2", 404)


def test_a_recording_that_grows_and_is_replaced(tmp_path):
    path, sim = tmp_path / "growing.usda", simulation()
    with UsdRecorder(sim, path, frames=9) as recorder:
        recorder.write()
        with Server(Footage(path)) as server:
            assert get(server, "/scene")["frames"] == [0]
            for frame in (1, 2, 3):
                sim.step()
                recorder.write()
                status = get(server, f"/status?since={frame}")
                assert status == {"take": 0, "frames": [frame], "live": None}
                _, arrays = packet(server, f"/frame/{frame}")
                assert np.array_equal(arrays["thing.ball"][:, :3], sim.position)
            recorder.close()  # of two writers of one file the second would be refused
            other = simulation(2)
            with UsdRecorder(other, path, frames=1, overwrite=True) as again:
                again.write()
                status = get(server, "/status?since=0")
                assert status["take"] > 0 and status["frames"] == [0]
                assert get(server, "/scene")["worlds"] == [0, 1]
                assert len(packet(server, "/frame/0")[1]["thing.ball"]) == 2 * (DROPS + 2)
            path.unlink()
            assert "FileNotFoundError" in refusal(server, "/status", 500)


def test_a_scene_runs_while_it_is_watched(live):
    scene = get(live, "/scene")
    assert scene["live"] and scene["frames"] == [0] and scene["title"] == "drops"
    assert get(live, "/status")["live"] == {
        "playing": False, "done": 0, "planned": FRAMES, "error": None,
    }  # fmt: skip
    assert get(live, "/live/play", "POST")["live"]["planned"] == FRAMES
    wait_for(lambda: get(live, "/status")["live"]["done"] == FRAMES)
    status = get(live, "/status")
    assert status["frames"] == list(range(FRAMES + 1)) and not status["live"]["playing"]
    other = simulation()
    for frame in range(FRAMES + 1):
        _, arrays = packet(live, f"/frame/{frame}")
        assert np.array_equal(arrays["thing.ball"][:, :3], other.position)
        other.step()


def test_pause_and_reset(live):
    start = packet(live, "/frame/0")[1]["thing.ball"]
    get(live, "/live/play", "POST")
    wait_for(lambda: get(live, "/status")["live"]["done"] >= 1)
    get(live, "/live/pause", "POST")
    wait_for(lambda: not get(live, "/status")["live"]["playing"])
    take = get(live, "/status")["take"]
    status = get(live, "/live/reset", "POST")
    assert status["take"] != take and status["frames"] == [0]
    assert status["live"]["done"] == 0 and not status["live"]["playing"]
    assert np.array_equal(packet(live, "/frame/0")[1]["thing.ball"], start)
    refusal(live, "/frame/1", 404)
    # Takes do not pile up: this one and the one before are kept.
    for _ in range(3):
        get(live, "/live/reset", "POST")
    assert len(list(live.footage.path.parent.glob("*.usda"))) == 2
    get(live, "/live/play", "POST")
    wait_for(lambda: get(live, "/status")["live"]["done"] == FRAMES)


def test_a_scene_that_fails_says_why_and_can_be_reset(monkeypatch):
    sim = simulation()
    step = sim.step

    def fail():
        if sim.frame == 2:
            raise RuntimeError("particle 3 of world 0 has left")
        step()

    monkeypatch.setattr(sim, "step", fail)
    running = Live(sim, FRAMES)
    with Server(running) as server:
        get(server, "/live/play", "POST")
        wait_for(lambda: get(server, "/status")["live"]["error"])
        status = get(server, "/status")
        assert status["live"]["error"] == "particle 3 of world 0 has left"
        assert status["frames"] == [0, 1, 2] and not status["live"]["playing"]
        packet(server, "/frame/2")
        status = get(server, "/live/reset", "POST")
        assert status["live"]["error"] is None and status["frames"] == [0]
    folder = running.footage.path.parent
    running.close()
    assert not folder.exists()
