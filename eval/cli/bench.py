"""`muslin bench`: methods against each other by a protocol."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from muslin.eval.cli.options import Workers, check_place

if TYPE_CHECKING:
    from muslin.eval.bench.findings import Findings
    from muslin.eval.bench.outcome import Outcome


def bench(
    protocol: Annotated[
        Path, typer.Argument(metavar="PROTOCOL.toml", help="What is scored and shown; see scenes/protocols.")
    ],
    methods: Annotated[
        list[str], typer.Option("--method", metavar="NAME=DIR", help="A method's predictions. Repeatable.")
    ],
    dataset: Annotated[
        Path | None, typer.Option("--dataset", metavar="DIR", help="The truth, in place of the protocol's.")
    ] = None,
    out: Annotated[
        Path | None,
        typer.Option("--out", metavar="DIR", help="Write results, tables, figures, report.html there."),
    ] = None,
    workers: Workers = None,
) -> None:
    """Score methods on the samples of a protocol: tables with intervals, figures, one HTML report.

    A method's folder is a dataset with samples of the truth's ids, or holds a file or folder of meshes for
    each, named by its id. Methods are compared on the samples that all of them have; what is missing is
    counted. Exit code 1 if a prediction cannot be scored (NaN, another number of frames).

    \b
    Examples:
      muslin bench scenes/protocols/static_designs.toml --method ours=out/ours --method other=out/other \\
        --out out/bench
      muslin bench my.toml --method ours=out/ours --dataset out/data
    """
    from muslin.eval.bench.methods import parse_methods
    from muslin.eval.bench.protocol import load_protocol

    loaded, given = load_protocol(protocol), parse_methods(methods)
    if out is not None:
        check_place(out)

    from muslin.eval.bench.findings import findings
    from muslin.eval.bench.run import bench as run
    from muslin.eval.cli.progress import progress_bar

    with progress_bar("bench") as update:
        outcome = run(loaded, given, dataset, workers=workers, progress=update)
    found = findings(outcome)
    for line in _summary(outcome, found):
        typer.echo(line)
    if out is not None:
        _write(outcome, found, out)
    refused = {name: why for name in outcome.methods if (why := outcome.refused(name))}
    for name, reasons in refused.items():
        for sample, reason in reasons.items():
            typer.echo(f"  {name}, {sample}: {reason}", err=True)
    if refused:
        count = sum(map(len, refused.values()))
        typer.echo(f"muslin: {count} predictions cannot be scored", err=True)
        raise typer.Exit(1)


def _summary(outcome: Outcome, found: Findings) -> list[str]:
    from muslin.eval.bench.write import duels_markdown, markdown

    parts = [markdown(table) for table in found.tables]
    if found.duels:
        parts.append(duels_markdown(found.duels))
    for name in outcome.methods:
        if missing := outcome.missing(name):
            some = ", ".join(missing[:4]) + (" …" if len(missing) > 4 else "")
            parts.append(f"{name} lacks {len(missing)} of {len(outcome.entries)} samples: {some}")
    return parts


def _write(outcome: Outcome, found: Findings, out: Path) -> None:
    from muslin.eval.bench.report import bench_report
    from muslin.eval.bench.write import write_outcome
    from muslin.eval.page import write_atomically

    out.mkdir(parents=True, exist_ok=True)
    write_outcome(outcome, found, out)
    write_atomically(out / "report.html", bench_report(outcome, found).encode())
    typer.echo(str(out / "report.html"))
