"""`muslin repair`: make again what is damaged."""

from __future__ import annotations

from typing import Annotated

import typer

from muslin.eval.cli.options import (
    DatasetPlace,
    Device,
    Memory,
    Retries,
    Scheduler,
    Workers,
    check_device,
    cluster_of,
)
from muslin.eval.cli.stopping import terminated_like_interrupted


def repair(
    dataset: DatasetPlace,
    workers: Workers = None,
    device: Device = "cpu",
    samples: Annotated[
        list[str] | None, typer.Option("--sample", metavar="ID", help="Only this sample. Repeatable.")
    ] = None,
    scheduler: Scheduler = None,
    memory: Memory = "auto",
    retries: Retries = 3,
    dry_run: Annotated[
        bool, typer.Option("--dry-run", help="List what is damaged or missing; write nothing.")
    ] = False,
) -> None:
    """Verify every sample; make again what fails or is missing, as `muslin generate` made it.

    What is there of a sample that fails is moved to DIR/failed, never deleted; samples in quarantine are
    tried again. Exit code 1, and the list on
    standard error, if not all is well afterwards (with --dry-run: now).

    \b
    Examples:
      muslin repair out/demo --dry-run
      muslin repair out/demo --workers 8
      muslin repair out/demo --sample tshirt_mid_0123456789ab --workers 1
    """
    from muslin.eval.cli.progress import progress_bar
    from muslin.sim.dataset.repair import repair as run

    name = check_device(device)
    cluster = cluster_of(workers, scheduler, memory, retries)
    note = f"{dataset}: what was finished is kept; run again to go on"
    with terminated_like_interrupted(note), progress_bar("repair") as update:
        result = run(
            dataset,
            ids=samples or None,
            workers=workers,
            cluster=cluster,
            device=name,
            dry=dry_run,
            progress=update,
        )
    for sample_id, reason in result.damaged.items():
        place = result.aside.get(sample_id)
        typer.echo(f"  {sample_id}: {reason}" + (f"; set aside as {place}" if place else ""))
    for sample_id in result.missing:
        typer.echo(f"  {sample_id}: missing")
    if result.index:
        typer.echo(f"  {result.index}" if dry_run else "  the index could not be read; written anew")
    typer.echo(
        f"{dataset}: {result.checked} samples checked, {len(result.damaged)} damaged, "
        f"{len(result.missing)} missing, {len(result.made)} made"
    )
    for sample_id, reason in result.failed.items():
        typer.echo(f"  {sample_id}: {reason}", err=True)
    if result.failed:
        typer.echo(f"muslin: {len(result.failed)} samples are still wrong", err=True)
    if not result.passed:
        raise typer.Exit(1)
