"""The commands usd info, usd check and usd pack."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from ..output.progress import Meter
from .shell import Debug, Overwrite, one_line_errors

usd = typer.Typer(help="Look into USD files, check them, and pack them.", rich_markup_mode=None)
UsdFile = Annotated[Path, typer.Argument(metavar="FILE", help="A recording, or any USD file.")]


@usd.command()
def info(file: UsdFile, debug: Debug = False) -> None:
    """Show what is inside: the stage, its frames, what is drawn, and bytes."""
    with one_line_errors(Meter(), debug):
        from . import usd_files as command

        typer.echo(command.show(file))


@usd.command()
def check(file: UsdFile, debug: Debug = False) -> None:
    """Look for faults at every frame, and show one line for each.

    Exit code 1: there are some.
    """
    with one_line_errors(Meter(), debug):
        from . import usd_files as command

        found = command.complaints(file)
        for line in found:
            typer.echo(line)
        if found:
            raise typer.Exit(1)
        typer.echo(f"{file}: no faults")


@usd.command()
def pack(
    file: UsdFile,
    out: Annotated[Path, typer.Option(help="File to write, .usdc or .usd.")],
    overwrite: Overwrite = False,
    debug: Debug = False,
) -> None:
    """Put a recording's frames into one file."""
    with one_line_errors(Meter(), debug):
        from . import usd_files as command

        typer.echo(command.packed(file, out, overwrite))
