"""The command line: list, run, measure and show scenes (see :mod:`particlesim.commands`).

Exit codes: 0 done, 1 a run that failed, 2 arguments that do not fit, 130 interrupted, 143
terminated. Whatever goes wrong is one line on stderr. Warp and USD are imported only when a scene
is, so that help is quick.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence
from typing import Annotated

import typer

from .commands import measure, run
from .commands.bench import bench
from .commands.number import measure as measure_number
from .commands.render import render
from .commands.shell import complain
from .commands.usd import usd
from .commands.view import view
from .scene import __version__

app = typer.Typer(
    help="Particle physics on NVIDIA Warp: forces and constraints in one loop.",
    pretty_exceptions_enable=False,
    rich_markup_mode=None,
    add_completion=False,
)


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line and return its exit code.

    Args:
        arguments: Words after the program's name; None: those of the process.
    """
    try:
        code = app(args=arguments, prog_name="particlesim", standalone_mode=False)
    except typer.TyperException as error:
        complain(error.format_message())
        return error.exit_code
    return code or 0


@app.callback(invoke_without_command=True)
def _root(
    context: typer.Context,
    version: Annotated[bool, typer.Option("--version", help="Show the version.")] = False,
) -> None:
    if version:
        typer.echo(f"particlesim {__version__}")
        raise typer.Exit
    if context.invoked_subcommand is None:
        typer.echo(context.get_help())


app.command("list")(run.list_scenes)
app.command()(run.run)
app.command()(run.explain)
app.command()(measure.tradeoff)
app.command()(measure.tune)
app.command()(measure.stress)
app.command("measure")(measure_number)
app.command()(bench)
app.command()(render)
app.command()(view)
app.command()(run.plot)
app.add_typer(usd, name="usd")


if __name__ == "__main__":
    sys.exit(main())
