"""The commands usd info, usd check and usd pack."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from .shell import Debug, Overwrite, opened

usd = typer.Typer(help="Look into USD files, check them, and pack them.", rich_markup_mode=None)
UsdFile = Annotated[Path, typer.Argument(metavar="FILE", help="A recording, or any USD file.")]


@usd.command()
def info(file: UsdFile, debug: Debug = False) -> None:
    """Show what is inside: the stage, its frames, what is drawn, and bytes."""
    with opened(debug):
        from ..output.usd.info import info as described

        typer.echo(str(described(file)))


@usd.command()
def check(file: UsdFile, debug: Debug = False) -> None:
    """Look for faults at every frame, and show one line for each.

    Exit code 1: there are some.
    """
    with opened(debug):
        from ..output.usd.checking.check import check as faults

        found = faults(file)
        for fault in found:
            typer.echo(str(fault))
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
    with opened(debug):
        from ..output.usd.pack import pack as packed

        frames = packed(file, out, overwrite=overwrite)
        size = out.stat().st_size
        typer.echo(f"{frames} frames of {file} written to {out}, {size:,} bytes")
