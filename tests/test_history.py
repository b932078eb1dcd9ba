"""Histories hold what the diagnostics say, survive a crash, and leave the run as it is."""

import csv
import json
import math
import os
import signal
import subprocess
import sys
import time

import numpy as np
import pytest

import particlesim as ps
from particlesim import cli
from particlesim.instruments.residuals import residuals
from particlesim.output.history.plots import PANELS, chosen, figure, plot_history
from particlesim.output.history.sample import sample
from particlesim.output.history.writer import History, read_history

OMEGA, STEPS = 2 * math.pi, 40  # of the oscillator: one period a second, steps a frame of 1/10 s


def oscillator(amplitude: float = 0.1) -> ps.Scene:
    """Two unit masses on a spring of k = omega^2 / 2, so that omega^2 = 2 k / m."""
    scene = ps.Scene()
    scene.add_particles([(-0.5 - amplitude / 2, 0, 0), (0.5 + amplitude / 2, 0, 0)])
    scene.add_interaction(ps.Springs([(0, 1)], stiffness=OMEGA**2 / 2, rest_length=1.0))
    return scene


def oscillation(worlds: int = 1, substeps: int = 4, **options) -> ps.Simulation:
    settings = ps.Settings(
        dt=0.1, substeps=substeps, integrator="velocity_verlet", precision="float64"
    )
    scenes = [oscillator(0.1 * (w + 1)) for w in range(worlds)]
    return ps.Simulation(scenes, settings, device="cpu")


def fluid() -> ps.Scene:
    """A block of water that falls into a box, on a rope that it hangs on with one drop."""
    scene = ps.Scene()
    block = ps.sample.box((0, 0, 0), (0.4, 0.4, 0.4), spacing=0.1)
    water = scene.add_particles(block, mass=1.0, radius=0.05, group="water")
    rope = scene.add_particles([(2, 0, 0), (2, 0.5, 0)], radius=0.1, pinned=[False, True])
    scene.add_interaction(ps.UniformGravity((0, -9.81, 0)))
    tait = ps.Tait(sound_speed=10.0)
    scene.add_interaction(
        ps.SPH(water, smoothing_length=0.2, rest_density=1000.0, equation_of_state=tait)
    )
    scene.add_constraint(ps.Distance([tuple(rope)], rest_length=0.4))
    scene.add_constraint(ps.BoxBoundary((-1, 0.02, -1), (3, 5, 2)))
    scene.add_constraint(ps.Contact(rope))
    return scene


def run(sim: ps.Simulation, path, frames: int) -> list:
    """A run with a history; returns the diagnostics of every frame."""
    found = [sim.diagnostics()]
    sim.run(frames, history=path, progress=lambda *_: found.append(sim.diagnostics()))
    return found


# Values


@pytest.mark.parametrize("suffix", [".csv", ".jsonl"])
def test_a_history_is_the_diagnostics(tmp_path, suffix):
    path = tmp_path / f"out{suffix}"
    found = run(oscillation(worlds=3), path, 4)
    record = read_history(path)
    assert record.frame.tolist() == [0, 1, 2, 3, 4] and record.world_count == 3
    np.testing.assert_allclose(record.time, 0.1 * record.frame, rtol=1e-15)
    # Written with all digits: not rounded at all.
    for name in ("mass", "momentum", "angular_momentum", "kinetic", "potential", "energy"):
        expected = np.array([getattr(each, name) for each in found])
        np.testing.assert_array_equal(record[name], expected)
    np.testing.assert_array_equal(record["potential:Springs"], record["potential"])


def test_files_are_what_other_programs_read(tmp_path):
    sim = oscillation(worlds=2)
    for name in ("out.csv", "out.jsonl"):
        with History(sim, tmp_path / name) as history:
            history.write()
    with open(tmp_path / "out.csv", newline="") as file:
        rows = list(csv.DictReader(file))
    assert [(row["frame"], row["world"]) for row in rows] == [("0", "0"), ("0", "1")]
    lines = [json.loads(line) for line in (tmp_path / "out.jsonl").read_text().splitlines()]
    assert [line["energy"] for line in lines] == [float(row["energy"]) for row in rows]


def test_potentials_of_interactions_add_up():
    sim = ps.Simulation(fluid(), ps.Settings(precision="float64"), device="cpu")
    values, total = sample(sim), sim.diagnostics()
    parts = values["potential:UniformGravity"] + values["potential:SPH"]
    # Rounding of sums over 66 particles.
    np.testing.assert_allclose(parts, total.potential, rtol=66 * 2**-52)
    height, mass = sim.position[:, 1], sim.get("mass")
    np.testing.assert_allclose(
        values["potential:UniformGravity"], 9.81 * np.sum(mass * height), rtol=1e-12
    )


def test_density_error_is_that_of_the_fluid():
    sim = ps.Simulation(fluid(), ps.Settings(precision="float64"), device="cpu")
    values = sample(sim)
    # rho_i = sum_j m W(r_ij, h), by brute force with Wendland's C2 of 3D:
    # W = 21 / (16 pi h^3) (1 - q/2)^4 (2 q + 1), q = r / h < 2.
    x = sim.position[:64]
    q = np.linalg.norm(x[:, None] - x, axis=2) / 0.2
    weight = 21 / (16 * np.pi * 0.2**3) * np.maximum(1 - q / 2, 0) ** 4 * (2 * q + 1)
    error = weight.sum(axis=1) / 1000 - 1
    np.testing.assert_allclose(values["density_error_max:SPH"], error.max(), rtol=1e-12)
    rms = np.sqrt(np.mean(error**2))
    np.testing.assert_allclose(values["density_error_rms:SPH"], rms, rtol=1e-12)


def test_residuals_are_those_of_the_geometry():
    scene = fluid()
    scene.add_particles([(2.15, 0.05, 0)], radius=0.1)  # not in the contact's group
    sim = ps.Simulation(scene, ps.Settings(precision="float64"), device="cpu")
    values = sample(sim)
    # The rope starts at 0.5 instead of 0.4; its radii do not touch.
    assert values["residual_max:Distance"] == pytest.approx(0.1, rel=1e-12)
    assert values["residual_max:Contact"] == 0
    # The deepest is the rope's end at height 0 with radius 0.1, over the floor at 0.02.
    assert values["residual_max:BoxBoundary"] == pytest.approx(0.12, rel=1e-12)
    depth = np.maximum(0.02 + sim.get("radius") - sim.position[:, 1], 0.0)
    rms = np.sqrt(np.mean(depth**2))
    assert values["residual_rms:BoxBoundary"] == pytest.approx(rms, rel=1e-12)


def test_overlaps_are_residuals_of_contacts():
    scene = ps.Scene(periodic=((0, 0, 0), (1, None, None)))
    scene.add_particles([(0.05, 0, 0), (0.9, 0, 0), (0.4, 0, 0), (0.45, 0, 0)], radius=0.1)
    scene.add_constraint(ps.Contact())
    sim = ps.Simulation(scene, ps.Settings(precision="float64"), device="cpu")
    missed, world = residuals(sim.constraints[0], sim)
    # Across the periodic face 0.15 apart, and 0.05 apart.
    np.testing.assert_allclose(np.sort(missed), [0.05, 0.05, 0.15, 0.15], rtol=1e-12)
    assert world.tolist() == [0] * 4


def test_inequalities_and_moving_boundaries():
    scene = ps.Scene()
    scene.add_particles([(0, 0, 0), (0, 1, 0), (0, 3, 0)], pinned=True)
    scene.add_constraint(ps.Distance([(0, 1), (1, 2)], rest_length=1.5, tension_only=True))
    scene.add_constraint(ps.PlaneBoundary((0, -1, 0), (0, 1, 0), velocity=(0, 2, 0)))
    sim = ps.Simulation(scene, ps.Settings(dt=0.25, precision="float64"), device="cpu")
    values = sample(sim)
    # The slack rope counts for nothing, the taut one is 0.5 too long; two ropes.
    assert values["residual_max:Distance"] == 0.5
    assert values["residual_rms:Distance"] == pytest.approx(math.sqrt(0.5**2 / 2))
    assert values["residual_max:PlaneBoundary"] == 0
    for _ in range(3):
        sim.step()
    # After 0.75 the plane is at -1 + 1.5.
    assert sample(sim)["residual_max:PlaneBoundary"] == pytest.approx(0.5, rel=1e-12)


def test_energy_of_an_oscillator_is_off_by_a_bounded_part(tmp_path):
    """Velocity Verlet keeps H' = v^2/2 + omega^2 x^2 (1 - (omega dt)^2 / 4) / 2 exactly.

    Started at rest at A: H - H' = omega^2 dt^2 / 8 omega^2 x^2, and H' is kept, so that
    H(t) - H(0) = (omega dt)^2 / 8 omega^2 (x^2 - A^2), between -(omega dt)^2 / 4 H(0) and 0.
    Over H(0) = omega^2 A^2 / 2 that is -(omega dt)^2 / 4 sin^2: about its middle +- (omega dt)^2/8.
    """
    path, substeps = tmp_path / "out.csv", 4
    sim = oscillation(substeps=substeps)
    sim.run(STEPS, history=path)
    record = read_history(path)
    change = record["energy"][:, 0] / record["energy"][0, 0] - 1
    bound = (OMEGA * 0.1 / substeps) ** 2 / 8
    middle = change + bound
    # Rounding of 160 steps and sums: far below the bound of 3e-3.
    assert np.abs(middle).max() <= bound * (1 + 1e-9)
    # At tenths of the period sin^2 is 0 or sin^2(72 degrees) = 0.9045 at most: 1 - 2 * 0.9045.
    assert middle.max() > 0.99 * bound and middle.min() < -0.8 * bound
    drift = PANELS["drift"](record).curves["drift"][:, 0]
    expected = change * record["energy"][0, 0] / record["kinetic"].max()
    # Both subtract numbers of order one, and are of order 1e-3.
    np.testing.assert_allclose(drift, expected, atol=1e-15)


# The run is left as it is


@pytest.mark.parametrize("integrator", ["symplectic_euler", "velocity_verlet"])
def test_a_history_does_not_touch_the_run(tmp_path, liquid, integrator):
    # A liquid that moves on by several skins: measuring renews rows in between.
    settings = ps.Settings(dt=0.05, substeps=10, integrator=integrator)
    scene = liquid(cells=3, cutoff=2.0)
    plain, watched = (ps.Simulation(scene, settings, device="cpu") for _ in range(2))
    plain.run(12)
    watched.run(12, history=tmp_path / "out.csv")
    np.testing.assert_array_equal(plain.position, watched.position)
    np.testing.assert_array_equal(plain.velocity, watched.velocity)


def test_density_stays_that_of_the_last_forces(tmp_path):
    plain, watched = (ps.Simulation(fluid(), device="cpu") for _ in range(2))
    plain.run(2)
    watched.run(2, history=tmp_path / "out.csv")
    np.testing.assert_array_equal(plain.get("density"), watched.get("density"))
    np.testing.assert_array_equal(plain.position, watched.position)


# Files


def test_a_last_line_that_is_cut_off_is_left_out(tmp_path):
    path = tmp_path / "out.csv"
    oscillation(worlds=2).run(3, history=path)
    whole, content = read_history(path), path.read_bytes()
    lines = content.splitlines(keepends=True)
    for cut in range(len(lines[-1]) + len(lines[-2])):
        path.write_bytes(content[: len(content) - cut])
        record = read_history(path)
        frames = 4 if cut == 0 else 3
        assert len(record.frame) == frames
        np.testing.assert_array_equal(record["energy"], whole["energy"][:frames])


def test_resuming_drops_what_comes_again(tmp_path):
    straight, broken = tmp_path / "straight.csv", tmp_path / "broken.csv"
    oscillation(worlds=2).run(6, history=straight)
    sim = oscillation(worlds=2)
    sim.run(5, history=broken)
    with open(broken, "ab") as file:
        file.write(b"5,0.5,0,0.1")  # killed within a line
    sim = oscillation(worlds=2)
    for _ in range(3):
        sim.step()
    with History(sim, broken, resume=True) as history:
        history.write()
        while sim.frame < 6:
            sim.step()
            history.write()
    assert broken.read_bytes() == straight.read_bytes()
    assert sorted(file.name for file in tmp_path.iterdir()) == ["broken.csv", "straight.csv"]


def test_a_resumed_run_has_the_history_of_one_that_was_not_broken(tmp_path):
    def go(folder, **options):
        folder.mkdir(exist_ok=True)
        sim = ps.Simulation(fluid(), device="cpu")
        files = {"record": folder / "out.usda", "history": folder / "out.csv"}
        sim.run(7, **files, checkpoint=3, **options)

    def stop(frame, frames):
        if frame == 5:
            raise KeyboardInterrupt

    go(tmp_path / "straight")
    with pytest.raises(KeyboardInterrupt):
        go(tmp_path / "broken", progress=stop)
    assert len(read_history(tmp_path / "broken" / "out.csv").frame) == 6
    go(tmp_path / "broken", resume=True)
    straight, broken = (
        (tmp_path / name / "out.csv").read_bytes() for name in ("straight", "broken")
    )
    assert straight == broken


def test_resuming_another_simulation_is_refused(tmp_path, refused):
    path = tmp_path / "out.csv"
    oscillation(worlds=2).run(1, history=path)
    before = path.read_bytes()
    with refused("hold 1 worlds"):
        History(oscillation(), path, resume=True)
    with (
        refused("hold mass"),
        History(ps.Simulation([fluid(), fluid()], device="cpu"), path, resume=True) as history,
    ):
        history.write()
    assert path.read_bytes()[:100] == before[:100]


def test_killed_at_any_moment_every_finished_line_reads(tmp_path):
    path = tmp_path / "out.csv"
    code = (
        f"import sys; sys.path.insert(0, {os.path.dirname(__file__)!r})\n"
        "from test_history import oscillation\n"
        f"oscillation(worlds=20).run(10**6, history={str(path)!r})"
    )
    process = subprocess.Popen([sys.executable, "-c", code], stdout=subprocess.DEVNULL)
    try:
        while not path.exists() or path.stat().st_size < 50_000:
            assert process.poll() is None
            time.sleep(0.01)
    finally:
        process.send_signal(signal.SIGKILL)
        process.wait()
    record = read_history(path)
    assert record.world_count == 20
    np.testing.assert_array_equal(record.frame, np.arange(len(record.frame)))
    assert len(record.frame) >= 1 and np.isfinite(record["energy"]).all()


def test_files_that_cannot_be_written(tmp_path, refused):
    sim = oscillation()
    with refused("end in .csv, .jsonl"):
        sim.run(1, history=tmp_path / "out.npz")
    with pytest.raises(FileNotFoundError, match="existing folder"):
        sim.run(1, history=tmp_path / "none" / "out.csv")
    (tmp_path / "out.csv").write_text("mine")
    with pytest.raises(FileExistsError, match="new file"):
        sim.run(1, history=tmp_path / "out.csv")
    assert (tmp_path / "out.csv").read_text() == "mine" and sim.frame == 0
    sim.run(1, history=tmp_path / "out.csv", overwrite=True)
    assert len(read_history(tmp_path / "out.csv").frame) == 2


@pytest.mark.skipif(not os.path.exists("/dev/full"), reason="needs a device that is full")
def test_a_full_disk_is_a_clear_error(tmp_path):
    (tmp_path / "out.csv").symlink_to("/dev/full")
    with pytest.raises(OSError, match="No space left"):
        oscillation().run(1, history=tmp_path / "out.csv", overwrite=True)


@pytest.mark.parametrize("content", ["a,b\n1,2\n", "frame,time,world\nx,y,z\n", "{}\n"])
@pytest.mark.parametrize("suffix", [".csv", ".jsonl"])
def test_files_that_are_no_histories(tmp_path, refused, content, suffix):
    path = tmp_path / f"out{suffix}"
    path.write_text(content)
    if (suffix, content) == (".csv", "{}\n"):
        assert len(read_history(path).frame) == 0  # a heading without lines
        return
    with refused("be a history"):
        read_history(path)


# Pictures


def test_a_plot_shows_the_diagnostics(tmp_path):
    pytest.importorskip("matplotlib")
    path = tmp_path / "out.csv"
    found = run(oscillation(worlds=2), path, 5)
    record = read_history(path)
    drawn = figure(record, list(chosen(record, ["energy", "momentum"]).values()))
    energies, momenta = drawn.axes
    lines = [line.get_ydata() for line in energies.get_lines()]
    expected = [
        [getattr(each, name)[w] for each in found]
        for name in ("kinetic", "potential", "energy")
        for w in range(2)
    ]
    np.testing.assert_array_equal(lines, expected)
    np.testing.assert_allclose(energies.get_lines()[0].get_xdata(), 0.1 * np.arange(6), rtol=1e-15)
    # The momentum of a spring is zero, but for rounding.
    changes = [line.get_ydata() for line in momenta.get_lines()]
    expected = [[e.momentum[w, k] - found[0].momentum[w, k] for e in found]
                for k in range(3) for w in range(2)]  # fmt: skip
    np.testing.assert_array_equal(changes, expected)


def test_all_panels_of_a_fluid(tmp_path):
    pytest.importorskip("matplotlib")
    sim = ps.Simulation(fluid(), device="cpu")
    sim.run(2, history=tmp_path / "out.csv")
    assert plot_history(tmp_path / "out.csv", tmp_path / "out.png") == list(PANELS)
    for suffix in (".svg", ".pdf"):
        plot_history(tmp_path / "out.csv", tmp_path / f"out{suffix}", ["density"])
    for suffix, start in ((".png", b"\x89PNG"), (".svg", b"<?xml"), (".pdf", b"%PDF")):
        assert (tmp_path / f"out{suffix}").read_bytes().startswith(start)


def test_plots_that_cannot_be_drawn(tmp_path, refused):
    pytest.importorskip("matplotlib")
    path = tmp_path / "out.csv"
    oscillation().run(2, history=path)
    with refused("be one of energy, drift"):
        plot_history(path, tmp_path / "out.png", ["entropy"])
    with refused("something that the run recorded"):
        plot_history(path, tmp_path / "out.png", ["density"])
    with refused("end in .png"):
        plot_history(path, tmp_path / "out.bmp")
    path.write_text(path.read_text().splitlines(keepends=True)[0])
    with refused("have a frame"):
        plot_history(path, tmp_path / "out.png")
    assert [file.name for file in tmp_path.iterdir()] == ["out.csv"]
    (tmp_path / "out.png").write_text("mine")
    with pytest.raises(FileExistsError):
        plot_history(path, tmp_path / "out.png")


def test_the_command_line(tmp_path, monkeypatch, capsys):
    pytest.importorskip("matplotlib")
    monkeypatch.chdir(tmp_path)
    words = ["run", "spring_lattice", "--frames", "2", "--history", "out.csv", "--device", "cpu"]
    assert cli.main(words) == 0
    assert len(read_history("out.csv").frame) == 3
    assert cli.main(["plot", "out.csv", "--what", "energy,drift"]) == 0
    assert "energy, drift of out.csv drawn in out.png" in capsys.readouterr().out
    assert (tmp_path / "out.png").exists()
    assert cli.main(["plot", "out.csv"]) == 2
    assert cli.main(words) == 2
    assert cli.main(["plot", "none.csv", "--out", "b.png"]) == 2
    errors = capsys.readouterr().err
    assert errors.count("error: ") == errors.count("\n") == 3


def test_a_plot_without_matplotlib(tmp_path, monkeypatch):
    oscillation().run(1, history=tmp_path / "out.csv")
    monkeypatch.setitem(sys.modules, "matplotlib", None)
    monkeypatch.setitem(sys.modules, "matplotlib.figure", None)
    with pytest.raises(ImportError, match=r"pip install 'particlesim\[plot\]'"):
        plot_history(tmp_path / "out.csv", tmp_path / "out.png")
