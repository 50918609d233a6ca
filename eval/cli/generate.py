"""`muslin generate`: a dataset from its configuration."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from muslin.eval.cli.options import Device, Overrides, Workers, check_device

if TYPE_CHECKING:
    from muslin.sim.scene import ExpectTable


def generate(
    config: Annotated[Path, typer.Argument(metavar="DATASET.toml", help="What to make.")],
    out: Annotated[Path, typer.Option("--out", metavar="DIR", help="Folder of the dataset, new or begun.")],
    workers: Workers = None,
    overrides: Overrides = None,
    device: Device = "cpu",
) -> None:
    """Make every sample of a dataset that is not there yet.

    Stop it at any moment; run it again and it goes on: a sample is there whole or not at all. Exit code 3 if
    samples could not be simulated, 1 if one does not keep what the file's [expect] says.

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
    if not result.card:
        typer.echo(
            f"{out}/README.md: left as it is, for it is no dataset card; move it away to have one written"
        )
    if result.failed:
        for sample_id, reason in result.failed.items():
            typer.echo(f"  {sample_id}: {reason}", err=True)
        typer.echo(f"muslin: {len(result.failed)} samples could not be simulated", err=True)
        raise typer.Exit(3)
    unmet = _unmet(out, loaded.expect, result.made)
    for line in unmet:
        typer.echo(f"  {line}", err=True)
    if unmet:
        typer.echo(f"muslin: {len(unmet)} expectations of {config} are not met", err=True)
        raise typer.Exit(1)


def _unmet(root: Path, expect: ExpectTable, made: Sequence[str]) -> list[str]:
    """What of `expect` the new samples do not keep, one sentence each."""
    from muslin.sim.dataset.reader import open_dataset
    from muslin.sim.expect import check_expectations
    from muslin.sim.scene import parse_scene

    dataset = open_dataset(root)
    lines = []
    for sample_id in made:
        sample = dataset[sample_id]
        scene = parse_scene(sample.scene).model_copy(update={"expect": expect})
        lines += [f"{sample_id}: {violation}" for violation in check_expectations(scene, sample)]
    return lines
