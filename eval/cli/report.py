"""`muslin report`: a dataset as a page."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Annotated

import typer

from muslin.eval.cli.options import DatasetPlace, Workers, make_parent
from muslin.garments.errors import InputError

KEYS = {"cloth_cloth_intersections", "cloth_body_intersections", "failed"}


def report(
    dataset: DatasetPlace,
    html_file: Annotated[
        Path, typer.Option("--html", metavar="FILE", help="The page, replacing the last one.")
    ],
    verification: Annotated[
        Path | None,
        typer.Option(
            "--verification", metavar="FILE", help="What `muslin verify --json` wrote, to be told too."
        ),
    ] = None,
    drapes: Annotated[int, typer.Option("--drapes", min=0, help="Most drapes to picture.")] = 24,
    sequences: Annotated[int, typer.Option("--sequences", min=0, help="Most sequences to picture.")] = 4,
    workers: Workers = None,
) -> None:
    """Write one HTML file that shows a dataset: pictures, patterns, certificates, computing time.

    The file holds everything it shows and needs no network.

    \b
    Examples:
      muslin report out/demo --html out/demo-report.html
      muslin report out/demo --html report.html --verification out/demo-verified.json
    """
    from muslin.eval.cli.progress import progress_bar
    from muslin.eval.page import write_atomically
    from muslin.eval.report import dataset_report

    make_parent(html_file)
    verified = None if verification is None else _read(verification)
    with progress_bar("draw") as update:
        page = dataset_report(
            dataset,
            verification=verified,
            most_drapes=drapes,
            most_sequences=sequences,
            workers=workers,
            progress=update,
        )
    write_atomically(html_file, page.encode())
    typer.echo(f"{html_file}: {len(page) / 1e6:.1f} MB")


def _read(path: Path) -> dict:
    try:
        values = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError) as error:
        raise InputError(
            f"{path}: not readable as JSON ({error}); give what `muslin verify --json` wrote"
        ) from error
    if not isinstance(values, dict) or not values.keys() >= KEYS:
        raise InputError(f"{path}: lacks {', '.join(sorted(KEYS))}; give what `muslin verify --json` wrote")
    return values
