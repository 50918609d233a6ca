"""`muslin predict`: learned drapes and sequences."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from muslin.eval.cli.options import (
    Force,
    Overrides,
    Where,
    check_empty_folder,
    check_new,
    conditions_of,
)
from muslin.garments.errors import InputError

if TYPE_CHECKING:
    from muslin.learn.wrinkles.predict import Animator
    from muslin.learn.wrinkles.process import Drawing
    from muslin.sim.dataset.reader import Dataset


def predict(
    out: Annotated[
        Path,
        typer.Option("--out", metavar="FILE", help="FILE.obj, or a new folder with --dataset and --scene."),
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
        int, typer.Option("--seed", min=0, help="With --target-area another mesh; of sequences other noise.")
    ] = 0,
    dataset: Annotated[
        str | None, typer.Option("--dataset", metavar="DIR", help="Predict all samples of a dataset instead.")
    ] = None,
    split: Annotated[str | None, typer.Option("--split", metavar="NAME", help="Of the dataset.")] = None,
    where: Where = None,
    scene: Annotated[
        Path | None,
        typer.Option("--scene", metavar="SCENE.toml", help="Predict the sequence of a scene instead."),
    ] = None,
    overrides: Overrides = None,
    baseline: Annotated[
        str | None,
        typer.Option(
            "--baseline",
            metavar="KIND",
            help="With --dataset, not networks: nearest, mean-on-skin (sequences: template-on-skin).",
        ),
    ] = None,
    push_out: Annotated[
        bool, typer.Option("--push-out", help="Take out of the body what was predicted inside it.")
    ] = False,
    drawn: Annotated[
        str,
        typer.Option("--draw", metavar="SAMPLER[:STEPS]", help="Of sequences: ddpm, ddim, dpm; euler; once."),
    ] = "",
    strength: Annotated[
        float,
        typer.Option("--strength", help="Of sequences: share of noise, the rest being the frame before."),
    ] = 1.0,
    fresh_noise: Annotated[
        bool, typer.Option("--fresh-noise", help="Of sequences: other noise in every frame.")
    ] = False,
    force: Force = False,
) -> None:
    """Predict by trained networks: the drape of a garment, the sequence of a scene, or all of a dataset, as a
    dataset to be scored.

    \b
    Examples:
      muslin predict --design garment_length=0.8 --beta 1.5 --out tee.obj
      muslin predict out/pipeline --design sleeve_length=0.3 --beta 1.5 --out tee.obj
      muslin predict out/pipeline --dataset out/thesis_static --split test-designs --out out/predicted
      muslin predict out/pipeline --dataset out/thesis_static --baseline nearest --out out/nearest
      muslin predict out/temporal --scene scenes/tshirt_walk.toml --out out/walk
      muslin predict out/temporal --dataset out/thesis_animated --draw dpm:10 --out out/animated
    """
    given = dict(_parameter(entry) for entry in design or [])
    if (dataset is not None or scene is not None) and (given or beta or fabric or target_area):
        raise InputError(
            "--dataset and --scene say garments, shapes and fabrics themselves; leave out the other options"
        )
    if dataset is not None and scene is not None:
        raise InputError("--dataset and --scene exclude each other")
    if dataset is None and baseline is not None:
        raise InputError("--baseline is a yardstick for whole datasets; give --dataset too")
    if dataset is None and scene is None:
        if out.suffix.lower() != ".obj":
            raise InputError(f"{out}: a garment is written as .obj, not {out.suffix!r}")
        check_new(out, force)

    from muslin.learn.training.machine import use_all_cores
    from muslin.sim.dataset.selection import select

    use_all_cores()
    truth = None if dataset is None else select(dataset, split, conditions_of(where))
    if scene is not None or (truth is not None and _moves(truth, model)):
        drawing = _drawing(drawn, strength)
        animator = _animator(model, drawing, fresh_noise, baseline, truth)
        _animate(animator, truth, scene, overrides, out, seed, push_out)
        return
    if drawn or fresh_noise or strength != 1.0:
        raise InputError("--draw, --strength and --fresh-noise are of sequences; leave them out")
    _drape(model, truth, baseline, push_out, given, beta, fabric, target_area, seed, out)


def _moves(truth: Dataset, model: Path | None) -> bool:
    """Whether it is sequences that are to be predicted."""
    from muslin.learn.wrinkles.model import holds_wrinkles

    if model is not None:
        return holds_wrinkles(model)
    return any(row["kind"] == "sequence" for row in truth.rows)


def _drawing(drawn: str, strength: float) -> Drawing:
    from muslin.learn.wrinkles.process import Drawing

    sampler, _, steps = drawn.partition(":")
    if steps and not steps.isdigit():
        raise InputError(f"--draw {drawn!r}: must be SAMPLER or SAMPLER:STEPS, e.g. dpm:10")
    return Drawing(sampler, int(steps or 0), strength)


def _animator(
    model: Path | None, drawing: Drawing, fresh_noise: bool, baseline: str | None, truth: Dataset | None
) -> Animator:
    from muslin.learn.wrinkles.baselines import baseline_of
    from muslin.learn.wrinkles.model import SHIPPED, load_wrinkles
    from muslin.sim.dataset.reader import open_dataset

    loaded = load_wrinkles(model or SHIPPED)
    loaded.drawing = drawing.of(loaded.process.kind)
    loaded.noise = "fresh" if fresh_noise else "fixed"
    if baseline is None:
        return loaded
    assert truth is not None
    return baseline_of(loaded, baseline, open_dataset(truth.root))


def _animate(
    animator: Animator,
    truth: Dataset | None,
    scene: Path | None,
    overrides: list[str] | None,
    out: Path,
    seed: int,
    push_out: bool,
) -> None:
    from muslin.eval.cli.progress import progress_bar
    from muslin.learn.wrinkles.predict import predict_scene, predict_sequences
    from muslin.sim.dataset.reader import write_dataset
    from muslin.sim.scene import load_scene

    if truth is not None:
        with progress_bar("predict") as update:
            made = predict_sequences(animator, truth, out, seed=seed, push_out=push_out, progress=update)
        typer.echo(f"{out}: {len(made)} samples")
        return
    assert scene is not None
    check_empty_folder(out)
    sample = predict_scene(animator, load_scene(scene, overrides or []), seed=seed, push_out=push_out)
    write_dataset(out, [sample], config={"name": "prediction", "of": str(scene)})
    typer.echo(f"{out}: {sample.id}, {sample.num_frames} frames, {sample.num_vertices} vertices")


def _drape(
    model: Path | None,
    truth: Dataset | None,
    baseline: str | None,
    push_out: bool,
    given: dict[str, float],
    beta: list[float] | None,
    fabric: str | None,
    target_area: float | None,
    seed: int,
    out: Path,
) -> None:
    from muslin.eval.cli.progress import progress_bar
    from muslin.garments.obj import write_garment
    from muslin.learn.drape.baselines import baseline_of
    from muslin.learn.drape.predict import SHIPPED, garment_of, load_draper, predict_dataset, predict_one
    from muslin.learn.drape.push_out import PushedOut
    from muslin.sim.dataset.reader import open_dataset

    draper = load_draper(model or SHIPPED)
    if baseline is not None:
        assert truth is not None
        draper = baseline_of(draper, baseline, open_dataset(truth.root))
    if push_out:
        draper = PushedOut(draper)
    if truth is not None:
        with progress_bar("predict") as update:
            made = predict_dataset(draper, truth, out, progress=update)
        typer.echo(f"{out}: {len(made)} samples")
        return
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
