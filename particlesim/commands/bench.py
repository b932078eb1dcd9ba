"""The command bench: races between simulations, and with other programs."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from .. import validate
from ..output.progress import Meter
from .scene_files import parse_options
from .shell import Debug, Overwrite, opened, start_warp

if TYPE_CHECKING:
    from ..accuracy.bench.result import Result

OWNER = "bench"


Names = Annotated[
    list[str] | None, typer.Argument(metavar="NAME", help="Cases. Default: all of them.")
]
ShowList = Annotated[bool, typer.Option("--list", help="List the cases, and run none.")]
Peers = Annotated[
    bool, typer.Option("--peers", help="Race other programs too, where they are installed.")
]
BenchDevice = Annotated[str, typer.Option(help="cpu, cuda or cuda:N; peers stay on the CPU.")]
Threads = Annotated[
    str | None, typer.Option(metavar="N,...", help="Cores for each, peers too. Default: all.")
]
Repeats = Annotated[int | None, typer.Option(min=1, help="Timed blocks. Default: the case's own.")]
CaseOptions = Annotated[
    list[str] | None,
    typer.Option("--set", metavar="NAME=VALUE", help="Set an option of the case; repeat."),
]
JsonFile = Annotated[
    Path | None, typer.Option("--json", metavar="FILE", help="File to write all figures to.")
]
Folder = Annotated[
    Path | None, typer.Option(help="Folder of cases. Default: tests/benchmarks of a checkout.")
]


def bench(
    names: Names = None,
    show_list: ShowList = False,
    peers: Peers = False,
    device: BenchDevice = "cpu",
    threads: Threads = None,
    repeats: Repeats = None,
    options: CaseOptions = None,
    save: JsonFile = None,
    folder: Folder = None,
    overwrite: Overwrite = False,
    debug: Debug = False,
) -> None:
    """Measure how fast cases run, ours and other programs' on the same work, in turn."""
    with opened(debug) as meter:
        start_warp(debug)
        from ..accuracy.bench.files import cases_in, title_of
        from ..accuracy.bench.machine import describe, machine
        from ..accuracy.table import write
        from ..output.files import check_new

        there = cases_in(folder)
        if show_list:
            for name, path in there.items():
                typer.echo(f"{name:<{max(map(len, there))}}  {title_of(path)}")
            return
        for name in names or ():
            validate.choice(OWNER, "NAME", name, list(there))
        if save is not None:
            consent = "give --overwrite"
            check_new(
                OWNER, save, overwrite, argument="--json", suffixes=(".json",), consent=consent
            )
        facts = machine()
        typer.echo(describe(facts))
        asked = {
            "options": parse_options(options or ()), "threads": _cores(threads), "device": device,
            "peers": peers, "repeats": repeats,
        }  # fmt: skip
        results = [_race(meter, name, there[name], asked) for name in names or there]
        if save is not None:
            content = {"machine": facts, "cases": [each.plain for each in results]}
            write(OWNER, save, json.dumps(content, indent=1).encode())
        if not all(each.good for each in results):
            raise typer.Exit(1)


def _race(meter: Meter, name: str, path: Path, asked: dict[str, Any]) -> Result:
    """Run a case, and print what it gave."""
    from ..accuracy.bench.race import race

    with meter.count(name, "blocks") as progress:
        result = race(path, progress=progress, **asked)
    typer.echo(f"\n{result}")
    return result


def _cores(text: str | None) -> list[int]:
    """The numbers of cores that are asked for."""
    from ..engine.execution.executors import available_threads

    most = available_threads()
    if text is None:
        return [most]
    words = [word.strip() for word in text.split(",")]
    if not all(word.isdigit() and 1 <= int(word) <= most for word in words):
        raise validate.fail(OWNER, "--threads", f"be numbers from 1 to {most}", text, "as 1 or 1,2")
    return [int(word) for word in words]
