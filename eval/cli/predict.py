"""`muslin predict`: learned drapes."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from muslin.eval.cli.options import Force, check_new
from muslin.garments.errors import InputError


def predict(
    out: Annotated[
        Path, typer.Option("--out", metavar="FILE", help="FILE.obj, or a new folder with --dataset.")
    ],
    model: Annotated[
        Path | None,
        typer.Argument(
            metavar="[MODEL_DIR]", help="What `muslin train` wrote; else the tees that come with muslin."
        ),
    ] = None,
    design: Annotated[
        list[str] | None,
        typer.Option("--design", metavar="KEY=METRES", help="A design parameter. Repeatable."),
    ] = None,
    beta: Annotated[
        list[float] | None, typer.Option("--beta", help="Body shape, standard deviations. Repeatable.")
    ] = None,
    fabric: Annotated[str | None, typer.Option("--fabric", help="By default the first it knows.")] = None,
    target_area: Annotated[
        float | None,
        typer.Option("--target-area", metavar="A", help="Mean triangle area, m²; else the 4,000 template."),
    ] = None,
    seed: Annotated[
        int, typer.Option("--seed", min=0, help="With --target-area: another one, another mesh.")
    ] = 0,
    dataset: Annotated[
        str | None, typer.Option("--dataset", metavar="DIR", help="Predict all samples of a dataset instead.")
    ] = None,
    split: Annotated[str | None, typer.Option("--split", metavar="NAME", help="Of the dataset.")] = None,
    baseline: Annotated[
        str | None,
        typer.Option(
            "--baseline", metavar="KIND", help="With --dataset: mean-on-skin or nearest, not the networks."
        ),
    ] = None,
    push_out: Annotated[
        bool, typer.Option("--push-out", help="Take out of the body what was predicted inside it.")
    ] = False,
    force: Force = False,
) -> None:
    """Drape a garment by trained networks, or all garments of a dataset, as a dataset to be scored.

    \b
    Examples:
      muslin predict --design garment_length=0.8 --beta 1.5 --out tee.obj
      muslin predict out/pipeline --design sleeve_length=0.3 --beta 1.5 --out tee.obj
      muslin predict out/pipeline --dataset out/thesis_static --split test-designs --out out/predicted
      muslin predict out/pipeline --dataset out/thesis_static --baseline nearest --out out/nearest
    """
    given = dict(_parameter(entry) for entry in design or [])
    if dataset is not None and (given or beta or fabric or target_area):
        raise InputError("--dataset says garments, shapes and fabrics itself; leave out the other options")
    if dataset is None:
        if baseline is not None:
            raise InputError("--baseline is a yardstick for whole datasets; give --dataset too")
        if out.suffix.lower() != ".obj":
            raise InputError(f"{out}: a garment is written as .obj, not {out.suffix!r}")
        check_new(out, force)

    from muslin.learn.drape.baselines import baseline_of
    from muslin.learn.drape.predict import SHIPPED, garment_of, load_draper, predict_dataset, predict_one
    from muslin.learn.drape.push_out import PushedOut
    from muslin.learn.training.machine import use_all_cores
    from muslin.sim.dataset.reader import open_dataset

    use_all_cores()
    draper = load_draper(model or SHIPPED)
    if baseline is not None:
        draper = baseline_of(draper, baseline, open_dataset(str(dataset)))
    if push_out:
        draper = PushedOut(draper)
    if dataset is not None:
        from muslin.eval.cli.progress import progress_bar
        from muslin.sim.dataset.selection import select

        with progress_bar("predict") as update:
            made = predict_dataset(draper, select(dataset, split), out, progress=update)
        typer.echo(f"{out}: {len(made)} samples")
        return

    from muslin.garments.obj import write_garment

    mesh = garment_of(draper.world.design, given, target_area, seed)
    sample = predict_one(draper, mesh, beta or [0.0], fabric or draper.world.fabrics[0])
    write_garment(mesh, out, sample.positions[0].astype("float64"))
    typer.echo(f"{out}: {sample.num_vertices} vertices, {sample.fabric}")


def _parameter(entry: str) -> tuple[str, float]:
    name, separator, value = entry.partition("=")
    try:
        if not separator or not name:
            raise ValueError
        return name, float(value)
    except ValueError as error:
        raise InputError(f"--design {entry!r}: must be KEY=METRES, e.g. sleeve_length=0.3") from error
