"""Trade-offs: the table, the sweep, its errors and references, and the command."""

import csv
import json
import math
import sys

import numpy as np
import pytest

import particlesim as ps
from particlesim import cli
from particlesim.tradeoff import Row, Tradeoff
from particlesim.tradeoff.command import parse_vary
from particlesim.tradeoff.output import amount
from particlesim.tradeoff.plan import Study
from particlesim.tradeoff.run import array_bytes

EXACT = ps.Settings(dt=0.1, precision="float64")


def fall(height=1.0, count=1):
    """Particles that fall freely; symplectic Euler is g h t / 2 too low after t."""
    scene = ps.Scene()
    scene.add_particles([(k, height, 0) for k in range(count)])
    scene.add_interaction(ps.UniformGravity((0, -10, 0)))
    return scene


def too_low(sim):
    return float(1 - 5 * sim.time**2 - sim.position[0, 1])


def oscillator(stiffness=100.0):
    """omega = 10: symplectic Euler explodes at h > 0.2."""
    scene = ps.Scene()
    scene.add_particles([(0, 0, 0)], pinned=True)
    scene.add_particles([(1.5, 0, 0)])
    scene.add_interaction(ps.Springs([(0, 1)], stiffness, 1.0))
    return scene


def sweep(build=fall, vary=None, **arguments):
    arguments = {
        "error": too_low, "frames": 4, "settings": EXACT, "repeats": 1, "device": "cpu",
        **arguments,
    }  # fmt: skip
    return ps.tradeoff(build, {"substeps": [1, 2, 4]} if vary is None else vary, **arguments)


def row(error, cost, cause="", **values):
    settings = ps.Settings(dt=1.0, substeps=values.get("substeps", 1))
    return Row(values, settings, {}, error, cause, (cost,), 100, 1000)


@pytest.fixture
def table():
    """Two families, of which one stops at a floor, and one that diverged."""
    rows = [row(math.inf, 0.5, "it exploded", substeps=1, precision="float32")]
    for n in (2, 4, 8, 16, 32):
        rows.append(row(max(8.0 / n**2, 0.5), 1.0 * n, substeps=n, precision="float32"))
        rows.append(row(8.0 / n**2, 1.5 * n, substeps=n, precision="float64"))
    vary = {"substeps": [1, 2, 4, 8, 16, 32], "precision": ["float32", "float64"]}
    return Tradeoff("test", "by design", rows, vary)


# The table


def test_pareto_and_cheapest(table):
    front = table.pareto()
    assert [(r.error, r.cost) for r in front] == [
        (2.0, 2.0), (0.5, 4.0), (0.125, 12.0), (8 / 256, 24.0), (8 / 1024, 48.0)
    ]  # fmt: skip
    assert table.cheapest(error=0.6) is front[1]
    assert table.cheapest(error=0.5) is front[1]
    assert table.fastest_stable() is front[0]
    assert [r.label() for r in table.diverged] == ["substeps=1, precision=float32"]


def test_cheapest_says_how_small_the_error_got(table, refused):
    with refused("error must be at least 0.00781, .*got 1e-09"):
        table.cheapest(error=1e-9)
    with refused("error must be finite"):
        table.cheapest(error=math.nan)


def test_a_table_where_all_diverged(refused):
    table = Tradeoff("test", "", [row(math.nan, 1.0, "no", substeps=1)], {"substeps": [1]})
    assert table.pareto() == [] and table.orders() == {}
    with refused("rows must hold one that did not diverge"):
        table.fastest_stable()
    with refused("inf, the smallest"):
        table.cheapest(error=1.0)
    assert "diverged, substeps=1: no" in str(table)


def test_order_leaves_out_floors_and_what_diverged(table):
    assert table.order("substeps") == pytest.approx(2.0)
    assert table.order("substeps", precision="float64") == pytest.approx(2.0)


@pytest.mark.parametrize(
    "knob, values, errors, order",
    [
        ("dt", [0.4, 0.2, 0.1], [1.6, 0.4, 0.1], 2.0),
        ("cutoff", [1.0, 2.0, 4.0], [1.0, 1 / 8, 1 / 64], 3.0),
        ("spacing", [1.0, 0.5, 0.25], [1.0, 0.5, 0.25], 1.0),
        ("iterations", [1, 2, 4], [0.1, 0.1, 0.1], 0.0),
        ("iterations", [1, 2, 4], [0.1, 0.2, 0.4], -1.0),
        ("substeps", [1, 2, 4, 8, 16, 32], [1, 0.9, 0.25, 1 / 16, 1 / 64, 1 / 256], 2.0),
        ("substeps", [1, 2, 4, 8, 16, 32], [1, 0.25, 1 / 16, 0.05, 0.05, 0.05], 2.0),
        ("substeps", [1, 4], [1, 0.25], 1.0),
        # No power law in any three: through all of them.
        ("substeps", [1, 2, 4], [1, 1, 1 / 16], 2.0),
    ],
)
def test_order(knob, values, errors, order):
    rows = [row(error, 1.0, **{knob: value}) for value, error in zip(values, errors, strict=True)]
    assert Tradeoff("test", "", rows, {knob: values}).order(knob) == pytest.approx(order)


def test_order_refuses(table, refused):
    with refused("knob must be one of substeps, precision, got 'dt'"):
        table.order("dt")
    with refused("values of precision must be numbers"):
        table.order("precision")
    with refused("name must be one of precision, got 'skin'", TypeError):
        table.order("substeps", skin=1.0)
    exact = Tradeoff("test", "", [row(0.0, 1.0, dt=d) for d in (1, 2)], {"dt": [1, 2]})
    with refused("settings that differ in dt must be at least two"):
        exact.order("dt")


def test_figures_of_a_row():
    settings = ps.Settings(dt=0.1, substeps=4)
    one = Row({}, settings, {}, 0.1, "", (2.0, 1.0, 4.0), 50, 0)
    assert (one.cost, one.spread) == (2.0, 0.75)
    # 50 particles, 40 substeps a simulated second, which takes 2 s.
    assert one.rate == pytest.approx(50 * 40 / 2)
    none = Row({}, settings, {}, math.nan, "at once", (), 50, 0)
    assert all(map(math.isnan, (none.cost, none.spread, none.rate)))


def test_the_text_of_a_table(table):
    lines = str(table).splitlines()
    (found,) = [line for line in lines if "0.125" in line and "float64" in line]
    # 100 particles, 8 substeps in 12 s.
    assert found.split() == ["8", "float64", "0.125", "12", "-", "66.7", "1000", "B", "*"]
    assert "order of convergence of substeps: 2.00" in lines
    assert lines[-1] == "diverged, substeps=1, precision=float32: it exploded"


@pytest.mark.parametrize(
    "value, step, text",
    [(0, 1000, "0 "), (999, 1000, "999 "), (12345, 1000, "12.3 k"), (2048, 1024, "2 Ki"),
     (1010, 1024, "0.986 Ki"), (3e12, 1000, "3e+03 G"), (math.nan, 1000, "-")],
)  # fmt: skip
def test_amounts(value, step, text):
    assert amount(value, step) == text


# Saving and drawing


def test_save_json(table, tmp_path):
    path = tmp_path / "table.json"
    table.save(path)
    found = json.loads(path.read_text())
    assert found["scene"] == "test" and found["order"]["substeps"] == pytest.approx(2.0)
    assert found["bound"] is None and len(found["rows"]) == len(table.rows)
    first = found["rows"][0]
    assert first["error"] is None and first["diverged"] and first["cause"] == "it exploded"
    assert first["settings"]["substeps"] == 1 and first["values"]["precision"] == "float32"
    assert [r["pareto"] for r in found["rows"]].count(True) == 5


def test_save_csv(table, tmp_path):
    path = tmp_path / "table.csv"
    table.save(str(path))
    rows = list(csv.DictReader(path.open()))
    assert len(rows) == len(table.rows)
    assert rows[1]["substeps"] == "2" and float(rows[1]["error"]) == 2.0
    assert float(rows[1]["wall_seconds_per_simulated_second"]) == 2.0
    assert rows[0]["diverged"] == "True"


@pytest.mark.parametrize("method, name", [("save", "x.json"), ("plot", "x.png")])
def test_files_are_not_overwritten_unasked(table, tmp_path, refused, method, name):
    if method == "plot":
        pytest.importorskip("matplotlib")
    path = tmp_path / name
    path.write_text("mine")
    with refused("path must be a new file"):
        getattr(table, method)(path)
    assert path.read_text() == "mine"
    getattr(table, method)(path, overwrite=True)
    assert path.read_bytes() != b"mine"
    with refused("path must end in"):
        getattr(table, method)(tmp_path / "x.txt")
    assert sorted(tmp_path.iterdir()) == [path]


@pytest.mark.parametrize(
    "suffix, start", [("png", b"\x89PNG"), ("svg", b"<?xml"), ("pdf", b"%PDF")]
)
def test_plot(table, tmp_path, suffix, start):
    pytest.importorskip("matplotlib")
    path = tmp_path / f"x.{suffix}"
    table.plot(path)
    assert path.read_bytes().startswith(start)


def test_plot_of_little(tmp_path):
    pytest.importorskip("matplotlib")
    exact = row(0.0, 1.0, substeps=1)
    for k, rows in enumerate(([exact], [row(math.nan, 1.0, "no", substeps=1)])):
        Tradeoff("test", "", rows, {"substeps": [1]}).plot(tmp_path / f"{k}.png")


def test_plot_without_matplotlib(table, tmp_path, monkeypatch, refused):
    monkeypatch.setitem(sys.modules, "matplotlib", None)
    monkeypatch.setitem(sys.modules, "matplotlib.figure", None)
    with refused(r"matplotlib must be installed.*particlesim\[plot\]", ImportError):
        table.plot(tmp_path / "x.png")


# The sweep


def test_a_sweep(device):
    seen = []
    table = sweep(
        vary={"substeps": [1, 2], "height": [1.0, 2.0]}, repeats=3, device=device,
        error=lambda sim: sim.position[0, 1], progress=lambda *at: seen.append(at),
    )  # fmt: skip
    assert [tuple(r.values.values()) for r in table.rows] == [(1, 1), (1, 2), (2, 1), (2, 2)]
    assert table.vary == {"substeps": [1, 2], "height": [1.0, 2.0]}
    assert all(len(r.costs) == 3 and r.cost > 0 for r in table.rows)
    assert table.rows[3].options == {"height": 2.0} and table.rows[3].settings.substeps == 2
    # 4 settings, 4 frames, 3 times.
    assert seen == [(k, 48) for k in range(1, 49)]
    # After 0.4 s in steps of 0.1: 1 - 10 * 0.1^2 * (1 + 2 + 3 + 4) = 0; an error has no sign.
    assert table.rows[0].error == pytest.approx(0.0, abs=1e-12)
    assert table.duration == pytest.approx(0.4)


def test_settings_run_in_turn(monkeypatch):
    from particlesim.tradeoff import run

    order = []
    advance = run.Run.advance
    monkeypatch.setattr(
        run.Run, "advance",
        lambda self, *rest: (order.append(self.plan.values["substeps"]), advance(self, *rest))[1],
    )  # fmt: skip
    sweep(repeats=3)
    assert order == [1, 2, 4] * 3


def test_time_stays_where_dt_varies(refused):
    table = sweep(vary={"dt": [0.2, 0.1, 0.05]})
    # g h t / 2 with h = dt / 10 substeps.
    np.testing.assert_allclose([r.error for r in table.rows], [0.04, 0.02, 0.01], rtol=1e-9)
    assert table.order("dt") == pytest.approx(1.0)
    with refused("vary dt must divide the simulated time, 0.4 s, got 0.3"):
        sweep(vary={"dt": [0.1, 0.3]})
    with refused("vary dt must divide"):
        sweep(vary={"dt": [0.0]})


def test_what_diverges_is_marked_and_kept():
    # 1000 s of h = 0.25, where a substep multiplies by 4.0 = 2.25 - 1 + ..: past any float.
    table = sweep(
        oscillator, {"substeps": [4, 1, 8]}, error="energy", frames=1000,
        settings=EXACT.replace(dt=1.0), repeats=2,
    )  # fmt: skip
    assert [r["substeps"] for r in table.diverged] == [4, 1]
    assert all("must stay finite" in r.cause and r.costs for r in table.diverged)
    assert table.fastest_stable()["substeps"] == 8
    assert str(table).count("diverged") == 2 + 2


def test_errors_beyond_the_bound_count_as_diverged():
    table = sweep(bound=0.15)
    # 10 * 0.1 * 0.4 / 2 = 0.2, 0.1, 0.05.
    assert [r.diverged for r in table.rows] == [True, False, False]
    assert table.rows[0].error == pytest.approx(0.2)
    assert "error must be at most 0.15, got 0.2" in table.rows[0].cause
    # Few frames of an explosion are still finite.
    table = sweep(
        oscillator, {"substeps": [1, 100]}, error="energy", frames=5,
        settings=EXACT.replace(dt=0.5),
    )  # fmt: skip
    assert [r.diverged for r in table.rows] == [True, False]


def test_an_error_that_is_not_finite():
    with pytest.warns(UserWarning, match="error must be finite for one setting at least, got nan"):
        table = sweep(error=lambda sim: math.nan)
    assert len(table.diverged) == 3 and "got nan at t = 0.4" in table.rows[0].cause


def test_it_starts_with_what_the_module_says():
    from particlesim.scenes import three_body

    study = Study(three_body.build, None, None, None, "cpu")
    assert (study.label, study.settings, study.frames) == ("three_body", three_body.settings, 200)
    assert study.known is three_body.error and study.known_here
    assert not Study(three_body.build, None, None, 100, "cpu").known_here
    study = Study(fall, None, None, None, "cpu")
    assert (study.label, study.settings, study.known) == ("fall", ps.Settings(), None)


def test_memory_counts_each_array_once():
    sim = ps.Simulation(fall(count=100), EXACT, device="cpu")
    before = array_bytes(sim)
    own = sum(a.capacity for a in sim.state.arrays.values())
    # Position and velocity are kept twice, for going back; mass and the like once.
    assert own < before < 3 * own
    sim.alias = [sim.state.position, {"again": sim.state.velocity}]
    assert array_bytes(sim) == before
    table = sweep(vary={"precision": ["float32", "float64"]}, options={"count": 100})
    assert 1.5 < table.rows[1].array_bytes / table.rows[0].array_bytes <= 2
    assert all(r.particles == 100 for r in table.rows)


@pytest.mark.parametrize(
    "arguments, match",
    [
        ({"vary": {}}, "vary must be a dict of lists"),
        ({"vary": {"substeps": 3}}, "'substeps'. must be a list"),
        ({"vary": {"precision": "float32"}}, "'precision'. must be a list"),
        ({"vary": {"substeps": []}}, "'substeps'. must hold a value"),
        ({"vary": {"substeps": [0]}}, "Settings: substeps must be"),
        ({"vary": {"substps": [1]}}, "got 'substps'; did you mean 'substeps'"),
        ({"vary": {"height": ["tall"]}}, "height must be a number, got 'tall'"),
        ({"options": {"substeps": 1}}, "options must name an option of fall"),
        ({"repeats": 0}, "repeats must be"),
        ({"frames": 0}, "frames times settings.dt must be above 0"),
        ({"settings": EXACT.replace(dt=0.0)}, "settings.dt must be above 0"),
        ({"bound": -1.0}, "bound must be above 0"),
        ({"error": "known"}, "error must be another where fall has no"),
        ({"error": "entropy"}, "error must be one of known, converged, energy, momentum"),
        ({"reference": {"substeps": 9}}, "error must be 'converged' with a reference"),
        ({"error": None, "reference": np.zeros((3, 3))}, "number of particles varies .1, 3."),
        ({"error": None, "reference": {"steps": 3}}, "reference must name .* got 'steps'"),
        ({"error": None, "vary": {"count": [1, 2]}}, "reference must say which count"),
        (
            {"error": None, "vary": {"count": [1, 2]}, "reference": {"count": 1}},
            "error must be a function.*number of particles varies",
        ),
        ({"error": None, "reference": {"count": 3}}, "reference must have 1 particles"),
    ],
)  # fmt: skip
def test_bad_arguments(refused, arguments, match):
    with refused(match):
        sweep(**arguments)


def test_arguments_of_the_wrong_kind(refused):
    with refused("build must be a function", TypeError):
        sweep(ps.Scene())
    with refused("settings must be a Settings", TypeError):
        sweep(settings={"dt": 1})


# References


@pytest.mark.parametrize(
    "reference",
    [None, {"precision": "float64"}, {"substeps": 4000}, EXACT.replace(substeps=4000),
     np.array([[0.0, 1 - 5 * 0.4**2, 0.0]])],
)  # fmt: skip
def test_references(reference):
    table = sweep(error="converged", reference=reference)
    # 0.2 / substeps; the reference is itself off by a tenth of the smallest at most.
    np.testing.assert_allclose([r.error for r in table.rows], [0.2, 0.1, 0.05], atol=0.1 * 0.05)
    assert "rms distance from" in table.error
    # 100 ti in the size of what is seen: it fell by 0.8.
    assert table.bound == pytest.approx(8.0, rel=0.01)


def test_a_reference_of_options():
    def attract(reach=1.0):
        scene = ps.Scene()
        scene.add_particles([(0, 0, 0), (0.9, 0, 0), (1.9, 0, 0)])
        scene.add_interaction(ps.LennardJones(cutoff=reach, sigma=0.9))
        return scene

    table = sweep(attract, {"reach": [1.5, 2.5]}, error=None, reference={"reach": 2.5})
    assert table.rows[1].error < 0.1 * table.rows[0].error


def test_distances_in_a_box_go_the_short_way():
    def drift():
        scene = ps.Scene(periodic=((0, 0, 0), (1, 1, 1)))
        scene.add_particles([(0.9, 0.5, 0.5)], velocity=(1.0, 0, 0))
        return scene

    table = sweep(drift, error=None, reference=np.array([[0.99, 0.5, 0.5]]), frames=1)
    # It is at 1.0, that is at 0.
    np.testing.assert_allclose([r.error for r in table.rows], 0.01, rtol=1e-9)


def test_a_reference_that_does_not_settle():
    rng = np.random.default_rng(0)

    def shaken():
        scene = fall()
        scene.interactions.clear()
        scene.add_interaction(ps.UniformGravity((0, rng.uniform(5, 15), 0)))
        return scene

    with pytest.warns(UserWarning, match="reference must stop changing"):
        table = sweep(shaken, error="converged")
    assert "changed by" in table.error


def test_a_reference_that_diverges():
    with pytest.raises(ps.SimulationError, match="the reference has diverged"):
        sweep(
            oscillator, {"substeps": [8]}, error="converged", frames=1000,
            settings=EXACT.replace(dt=1.0), reference={"substeps": 1},
        )  # fmt: skip


def test_momentum_drift():
    # 10 * 0.4 of momentum, sqrt(2 K) = 4 of it: all of it comes from outside.
    table = sweep(error="momentum")
    np.testing.assert_allclose([r.error for r in table.rows], 1.0, rtol=1e-12)

    def still():
        scene = ps.Scene()
        scene.add_particles([(0, 0, 0)])
        return scene

    assert [r.error for r in sweep(still, error="momentum").rows] == [0.0] * 3


# The command

SCENE = """
import particlesim as ps

settings = ps.Settings(dt=0.1, precision="float64")
frames = 4

def build(height: float):
    scene = ps.Scene()
    scene.add_particles([(0, height, 0)])
    scene.add_interaction(ps.UniformGravity((0, -10, 0)))
    return scene

def error(sim):
    return sim.scenes[0].position[0, 1] - 5 * sim.time**2 - sim.position[0, 1]
"""


@pytest.fixture
def command(tmp_path, capsys):
    """Runs the command on a scene; returns the exit code, stdout and stderr."""
    path = tmp_path / "falling.py"
    path.write_text(SCENE)

    def run(*arguments):
        words = ["tradeoff", str(path), "--device", "cpu", "--repeats", "1", *arguments]
        code = cli.main(words)
        output = capsys.readouterr()
        return code, output.out, output.err

    return run


def test_the_command(command, tmp_path):
    pytest.importorskip("matplotlib")
    picture, file = tmp_path / "x.png", tmp_path / "x.json"
    code, out, err = command(
        "--vary", "substeps=1,2,4", "--vary", "height=1.0,2.0", "--plot", str(picture),
        "--save", str(file),
    )  # fmt: skip
    assert (code, err) == (0, "")
    assert out.startswith("falling: 0.4 s on cpu, 1 run")
    assert "order of convergence of substeps: 1.00" in out
    assert picture.exists() and len(json.loads(file.read_text())["rows"]) == 6
    code, _, err = command("--vary", "substeps=1", "--save", str(file))
    assert code == 2 and "--save must be a new file" in err
    assert command("--vary", "height=1.0", "--save", str(file), "--overwrite")[0] == 0


def test_the_command_with_a_reference(command):
    code, out, _ = command(
        "--vary", "substeps=1,2", "--set", "height=3", "--frames", "2", "--error", "converged",
        "--reference", "substeps=64",
    )  # fmt: skip
    assert code == 0 and "rms distance from a reference of 64 substeps" in out


@pytest.mark.parametrize(
    "arguments, message",
    [
        ([], "--vary must be given"),
        (["--vary", "substeps"], "--vary must be NAME=VALUE,VALUE,..., got 'substeps'"),
        (["--vary", "substeps=1,,2"], "--vary must be NAME=VALUE"),
        (["--vary", "substeps=1", "--vary", "substeps=2"], "got 'substeps' twice"),
        (["--vary", "substps=1"], "did you mean 'substeps'"),
        (["--vary", "substeps=0"], "Settings: substeps must be a whole number"),
        (["--vary", "substeps=1"], "height must be set; give --set height=VALUE"),
        (["--vary", "height=1", "--error", "entropy"], "--error must be one of known"),
        (["--vary", "height=1", "--plot", "x.bmp"], "--plot must end in .png"),
        (["--vary", "height=1", "--save", "x.txt"], "--save must end in .json, .csv"),
        (["--vary", "height=1", "--repeats", "0"], "--repeats"),
        (["--vary", "height=1", "--set", "mass=1"], "--set must name an option"),
    ],
)
def test_bad_commands(command, arguments, message):
    code, out, err = command(*arguments)
    assert (code, out, err.count("\n")) == (2, "", 1)
    assert err.startswith("error: ") and message in err


def test_the_command_without_matplotlib(command, monkeypatch, tmp_path):
    monkeypatch.setitem(sys.modules, "matplotlib", None)
    monkeypatch.setitem(sys.modules, "matplotlib.figure", None)
    code, _, err = command("--vary", "height=1", "--plot", str(tmp_path / "x.png"))
    assert code == 2 and err.count("\n") == 1 and "pip install 'particlesim[plot]'" in err


def test_warnings_of_the_command_are_one_line(command, tmp_path):
    (tmp_path / "falling.py").write_text(SCENE.replace("return sim.", "return float('nan') * sim."))
    code, _, err = command("--vary", "height=1.0")
    assert code == 0 and err.startswith("warning: tradeoff: error must be finite")
    assert err.count("\n") == 1


def test_values_to_vary():
    vary = parse_vary(
        ["substeps=1,2, 5", "dt=1/60,0.1", "precision=float32", "wind=(0, 1, 0),(2,)"]
    )
    assert vary == {
        "substeps": [1, 2, 5], "dt": [1 / 60, 0.1], "precision": ["float32"],
        "wind": [(0, 1, 0), (2,)],
    }  # fmt: skip
