"""Tables of trade-offs: what they answer, how they are shown, saved and drawn."""

import csv
import json
import math
import sys

import pytest

import particlesim as ps
from particlesim.accuracy.table import amount
from particlesim.accuracy.tradeoff.row import Row
from particlesim.accuracy.tradeoff.table import Tradeoff


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
        ("substeps", [1, 2, 4, 8, 16, 32], [1, 0.5, 0.25, 1 / 16, 1 / 64, 1 / 256], 2.0),
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
    assert found.split() == ["8", "float64", "0.125", "12", "-", "66.7", "0.977", "KiB", "*"]
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
