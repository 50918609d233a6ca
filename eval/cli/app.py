"""The `muslin` command: its options, its errors, its commands."""

from __future__ import annotations

import os
import sys
from importlib.metadata import version
from typing import Annotated, Any

import typer
from typer.core import TyperGroup

from muslin.eval.cli.bench import bench
from muslin.eval.cli.compare import evaluate
from muslin.eval.cli.export import export
from muslin.eval.cli.generate import generate
from muslin.eval.cli.info import info
from muslin.eval.cli.pattern import pattern
from muslin.eval.cli.predict import predict
from muslin.eval.cli.remesh import remesh
from muslin.eval.cli.render import render
from muslin.eval.cli.repair import repair
from muslin.eval.cli.report import report
from muslin.eval.cli.simulate import simulate
from muslin.eval.cli.train import train
from muslin.eval.cli.validate import validate
from muslin.eval.cli.verify import verify
from muslin.eval.cli.view import view
from muslin.garments.errors import InputError

INPUT_ERROR, SIMULATION_ERROR = 2, 3


class Commands(TyperGroup):
    """Turns the two expected exceptions into one line on standard error and an exit code."""

    def invoke(self, ctx: Any) -> Any:
        try:
            return super().invoke(ctx)
        except InputError as error:
            typer.echo(f"muslin: {' '.join(str(error).split())}", err=True)
            raise typer.Exit(INPUT_ERROR) from error
        except Exception as error:
            # The solver is loaded only by the commands that simulate; if it is not, the error is another.
            solver = sys.modules.get("muslin.sim.solve.errors")
            if solver is None or not isinstance(error, solver.SimulationError):
                raise
            typer.echo(f"muslin: the simulation stopped: {' '.join(str(error).split())}", err=True)
            raise typer.Exit(SIMULATION_ERROR) from error


app = typer.Typer(
    name="muslin",
    cls=Commands,
    no_args_is_help=True,
    add_completion=False,
    rich_markup_mode=None,
    pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 100},
)


def _show_version(wanted: bool) -> None:
    if wanted:
        typer.echo(f"muslin {version('muslin')}")
        raise typer.Exit


@app.callback()
def root(
    show_version: Annotated[
        bool, typer.Option("--version", callback=_show_version, is_eager=True, help="Print the version.")
    ] = False,
) -> None:
    """From sewing patterns to verified datasets of simulated garments.

    \b
    Examples:
      muslin generate scenes/demo.toml --out out/demo    make a dataset
      muslin verify out/demo                             count its intersections again
      muslin report out/demo --html out/demo/report.html see it
      muslin eval out/prediction out/demo --html eval.html
    Every command tells more: muslin COMMAND --help. Exit codes: 1 verification or an expectation
    failed, 2 wrong input, 3 the simulation could not go on.
    """


for name, command, summary in (
    ("simulate", simulate, "One scene to a verified sample."),
    ("generate", generate, "A dataset from its configuration; goes on where it stopped."),
    ("verify", verify, "Count all intersections of a dataset again."),
    ("repair", repair, "Make again what is damaged or missing in a dataset."),
    ("info", info, "What a dataset holds."),
    ("predict", predict, "Learned drapes, of one garment or a dataset."),
    ("eval", evaluate, "Score a prediction against the truth."),
    ("bench", bench, "Methods against each other by a protocol."),
    ("report", report, "A dataset as one HTML page."),
    ("export", export, "Samples as files, or datasets in others' layouts."),
    ("pattern", pattern, "A sewing pattern as file, mesh or drawing."),
    ("remesh", remesh, "A draped garment in other triangles."),
    ("render", render, "Pictures and movies."),
    ("validate", validate, "The simulator against known solutions."),
    ("view", view, "Look at a sample in a window."),
):
    app.command(name, short_help=summary)(command)
app.add_typer(train, name="train", short_help="Networks from a dataset.")


def main() -> None:
    """Entry point of the console script."""
    # One process a core: the numerical libraries' own threads would only get in each other's way.
    for variable in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"):
        os.environ.setdefault(variable, "1")
    app()
