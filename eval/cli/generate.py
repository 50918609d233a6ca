"""`muslin generate`: a dataset from its configuration."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from muslin.eval.cli.options import (
    Device,
    Memory,
    Overrides,
    Retries,
    Scheduler,
    Workers,
    check_device,
    cluster_of,
)
from muslin.eval.cli.stopping import terminated_like_interrupted

if TYPE_CHECKING:
    from muslin.sim.dataset.generate import GenerateReport
    from muslin.sim.scene import ExpectTable

Preset = Annotated[
    str | None,
    typer.Option("--preset", metavar="NAME", help="A variant that the file holds: [presets.NAME]."),
]

MOST_TOLD = 20
"""Failures told one by one."""


def generate(
    config: Annotated[Path, typer.Argument(metavar="DATASET.toml", help="What to make.")],
    out: Annotated[
        str, typer.Option("--out", metavar="DIR", help="Where the dataset lies, or shall: folder or URL.")
    ],
    workers: Workers = None,
    preset: Preset = None,
    overrides: Overrides = None,
    device: Device = "cpu",
    scheduler: Scheduler = None,
    memory: Memory = "auto",
    retries: Retries = 3,
    retry: Annotated[bool, typer.Option("--retry", help="Try samples in quarantine again.")] = False,
    picture: Annotated[
        bool, typer.Option("--picture/--no-picture", help="Draw some of the samples beside the card.")
    ] = True,
) -> None:
    """Make every sample of a dataset that is not there yet.

    Stop it at any moment; run it again and it goes on: a sample is there whole or not at all. A sample that
    cannot be simulated, or over which its process dies time after time, goes into quarantine
    (DIR/failed/ID.json tells why), and the others go on. DIR may be a URL that fsspec knows. Exit code 3 if
    samples could not be made or are in quarantine, 1 if one does not keep what the file's [expect] says.

    \b
    Examples:
      muslin generate scenes/demo.toml --out out/demo
      muslin generate scenes/demo.toml --out out/demo --workers 8
      muslin generate scenes/demo.toml --out out/coarse --set scene.garment.edge_length=0.03
      muslin generate scenes/datasets/thesis_static.toml --preset small --out out/thesis_static
      muslin generate scenes/demo.toml --out s3://bucket/demo --scheduler tcp://10.0.0.1:8786
    """
    from muslin.eval.cli.progress import progress_bar
    from muslin.sim.dataset.config import load_config
    from muslin.sim.dataset.generate import generate as run

    loaded = load_config(config, overrides or [], preset)
    name = check_device(device)
    cluster = cluster_of(workers, scheduler, memory, retries)
    note = f"{out}: what was finished is kept; run again to go on"
    with terminated_like_interrupted(note), progress_bar("generate") as update:
        result = run(loaded, out, cluster=cluster, device=name, progress=update, retry=retry, picture=picture)
    typer.echo(f"{out}: {len(result.made)} samples made, {len(result.kept)} kept, {result.seconds:.1f} s")
    if not result.card:
        typer.echo(
            f"{out}/README.md: left as it is, for it is no dataset card; move it away to have one written"
        )
    if result.failed or result.held:
        _tell_failures(out, result)
        raise typer.Exit(3)
    unmet = _unmet(out, loaded.expect, result.made)
    for line in unmet:
        typer.echo(f"  {line}", err=True)
    if unmet:
        typer.echo(f"muslin: {len(unmet)} expectations of {config} are not met", err=True)
        raise typer.Exit(1)


def _tell_failures(out: str, result: GenerateReport) -> None:
    from muslin.sim.dataset.generate import BEHIND

    first = [(i, reason) for i, reason in result.failed.items() if not reason.startswith(BEHIND)]
    for sample_id, reason in first[:MOST_TOLD]:
        typer.echo(f"  {sample_id}: {reason}", err=True)
    if len(first) > MOST_TOLD:
        typer.echo(f"  and {len(first) - MOST_TOLD} more", err=True)
    if behind := len(result.failed) - len(first):
        typer.echo(f"  and {behind} that come after one of these in a chain", err=True)
    if result.failed:
        typer.echo(f"muslin: {len(result.failed)} samples could not be made; see {out}/failed", err=True)
    if result.held:
        typer.echo(
            f"muslin: {len(result.held)} samples were not tried, for they are in quarantine, or come after "
            f"one that is; see {out}/failed, and try again with --retry",
            err=True,
        )


def _unmet(place: str, expect: ExpectTable, made: Sequence[str]) -> list[str]:
    """What of `expect` the new samples do not keep, one sentence each."""
    from muslin.sim.dataset.reader import open_dataset
    from muslin.sim.expect import check_expectations
    from muslin.sim.scene import ExpectTable, parse_scene

    dataset, new = open_dataset(place), set(made)
    lines = []
    for row in dataset.rows:
        # Without anything to expect, the index tells all: samples of a large dataset are not read again.
        crossings = row["cloth_cloth_intersections"] or row["cloth_body_intersections"]
        if row["id"] in new and (crossings or expect != ExpectTable()):
            sample = dataset[row["id"]]
            scene = parse_scene(sample.scene).model_copy(update={"expect": expect})
            lines += [f"{sample.id}: {violation}" for violation in check_expectations(scene, sample)]
    return lines
