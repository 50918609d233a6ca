"""`muslin generate`: a dataset from its configuration."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from muslin.eval.cli.options import Device, Overrides, Workers, check_device


def generate(
    config: Annotated[Path, typer.Argument(metavar="DATASET.toml", help="What to make.")],
    out: Annotated[Path, typer.Option("--out", metavar="DIR", help="Folder of the dataset, new or begun.")],
    workers: Workers = None,
    overrides: Overrides = None,
    device: Device = "cpu",
) -> None:
    """Make every sample of a dataset that is not there yet.

    Stop it at any moment; run it again and it goes on: a sample is there whole or not at all.

    \b
    Examples:
      muslin generate scenes/demo.toml --out out/demo
      muslin generate scenes/demo.toml --out out/demo --workers 8
      muslin generate scenes/demo.toml --out out/coarse --set scene.garment.edge_length=0.03
    """
    from muslin.eval.cli.progress import progress_bar
    from muslin.sim.dataset.config import load_config
    from muslin.sim.dataset.generate import generate as run

    loaded = load_config(config, overrides or [])
    name = check_device(device)
    with progress_bar("generate") as update:

        def progress(done: float, total: int, message: str) -> None:
            update(done, total, message)

        result = run(loaded, out, workers=workers, device=name, progress=progress)
    typer.echo(f"{out}: {len(result.made)} samples made, {len(result.kept)} kept, {result.seconds:.1f} s")
    if result.failed:
        for sample_id, reason in result.failed.items():
            typer.echo(f"  {sample_id}: {reason}", err=True)
        typer.echo(f"muslin: {len(result.failed)} samples could not be simulated", err=True)
        raise typer.Exit(3)
