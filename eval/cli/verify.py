"""`muslin verify`: check a dataset's geometry again."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from muslin.eval.cli.options import DatasetPlace, Workers, make_parent


def verify(
    dataset: DatasetPlace,
    json_file: Annotated[
        Path | None,
        typer.Option("--json", metavar="FILE", help="Write the result there, replacing the last."),
    ] = None,
    workers: Workers = None,
) -> None:
    """Count the intersections of every frame again with ipctk; stored certificates are not believed.

    Exit code 1, and the list on standard error, if any sample fails.

    \b
    Examples:
      muslin verify out/demo
      muslin verify out/demo --json out/demo-verified.json
    """
    from muslin.eval.cli.progress import progress_bar
    from muslin.sim.dataset.verify import verify as run

    if json_file is not None:
        make_parent(json_file)
    with progress_bar("verify") as update:
        result = run(dataset, workers=workers, progress=update)
    if json_file is not None:
        result.write_json(json_file)
    typer.echo(
        f"{result.samples} samples, {result.frames} frames: "
        f"{result.cloth_cloth_intersections} cloth-cloth and {result.cloth_body_intersections} cloth-body "
        f"intersections, at most {result.masked_body_faces_max} body faces left out, "
        f"{len(result.failed)} failed" + (f", {result.missing} not made yet" if result.missing else "")
    )
    if result.failed:
        for sample_id, reason in result.failed.items():
            typer.echo(f"  {sample_id}: {reason}", err=True)
        raise typer.Exit(1)
