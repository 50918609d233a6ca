"""`muslin train`: networks from datasets."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from muslin.garments.errors import InputError

if TYPE_CHECKING:
    from muslin.learn.drape.dense import DenseDrapes
    from muslin.learn.training.loop import Settings

train = typer.Typer(help="Train networks on a dataset.", no_args_is_help=True, rich_markup_mode=None)


DrapesOf = Annotated[str, typer.Option("--dataset", metavar="DIR", help="Drapes: a folder or a URL.")]
Out = Annotated[Path, typer.Option("--out", metavar="DIR", help="Folder for the networks.")]
Rate = Annotated[float, typer.Option("--learning-rate", help="At its highest.")]
Batch = Annotated[int, typer.Option("--batch", min=1, help="Drapes in a batch.")]
Seed = Annotated[int, typer.Option("--seed", min=0, help="Of weights and batches.")]
Precision = Annotated[str, typer.Option("--precision", help="no (float32) or bf16 (mixed).")]


@train.command()
def drape(
    dataset: DrapesOf,
    out: Out,
    epochs: Annotated[int, typer.Option("--epochs", min=1, help="Of R_smooth and of each R_fine.")] = 60,
    batch: Batch = 8,
    learning_rate: Rate = 3e-3,
    order: Annotated[int, typer.Option("--order", min=1, help="K of the Chebyshev polynomials.")] = 3,
    fabric_input: Annotated[
        bool, typer.Option("--fabric-input", help="One R_fine that sees the fabric, not one a fabric.")
    ] = False,
    skinned: Annotated[
        bool, typer.Option("--skinned", help="Start from the mean drape carried along by the skin.")
    ] = False,
    precision: Precision = "no",
    seed: Seed = 0,
) -> None:
    """Train the pipeline for static drapes: R_mean, R_smooth and R_fine, on the split "train".

    Stop it at any moment; the same command goes on. DIR/train has logs for TensorBoard and loss curves.

    \b
    Examples:
      muslin train drape --dataset out/thesis_static --out out/pipeline
      muslin train drape --dataset out/thesis_static --out out/one_for_all --fabric-input
    """
    from dataclasses import replace

    from muslin.learn.drape.train import DrapeSettings, train_pipeline
    from muslin.sim.dataset.reader import open_dataset

    each = _settings(epochs, learning_rate, precision, seed)
    settings = replace(
        DrapeSettings(smooth=each, fine=each),
        batch=batch,
        order=order,
        fabric_input=fabric_input,
        skinned=skinned,
    )
    with _stages() as stage:
        pipeline = train_pipeline(open_dataset(dataset), out, settings, stage)
    _tell(out, [pipeline.smooth, *pipeline.fine.values()])


@train.command()
def collisions(
    model: Annotated[Path, typer.Argument(metavar="MODEL_DIR", help="A pipeline of `muslin train drape`.")],
    dataset: DrapesOf,
    out: Out,
    epochs: Annotated[int, typer.Option("--epochs", min=1, help="Of each R_fine.")] = 20,
    loss: Annotated[
        str, typer.Option("--loss", metavar="KIND", help="distance (exact), or nearest-vertex (the thesis').")
    ] = "distance",
    garments: Annotated[int, typer.Option("--garments", min=1, help="Random ones that it learns on.")] = 48,
    anchor: Annotated[
        float, typer.Option("--anchor", min=0.0, help="Weight of staying what it was; the thesis: 0.")
    ] = 0.01,
    batch: Batch = 4,
    learning_rate: Rate = 3e-4,
    seed: Seed = 0,
) -> None:
    """Fine-tune R_fine against penetration: random garments on random bodies, and no simulation.

    The dataset says between which designs the random ones lie, and on which the share of vertices inside the
    body is logged.

    \b
    Examples:
      muslin train collisions out/pipeline --dataset out/thesis_static --out out/tuned
    """
    from muslin.learn.drape.examples import read_examples
    from muslin.learn.drape.fine_tune import FineTuning, fine_tune
    from muslin.learn.drape.pipeline import load_pipeline
    from muslin.learn.drape.smoothing import LENGTH
    from muslin.sim.dataset.reader import open_dataset

    if loss not in ("distance", "nearest-vertex"):
        raise InputError(f"--loss {loss}: must be distance or nearest-vertex")
    given = open_dataset(dataset)
    others = [name for name in given.splits if name != "train"]
    examples = read_examples(given.split("train"), LENGTH)
    validation = {name: read_examples(given.split(name), LENGTH) for name in others}
    settings = _settings(epochs, learning_rate, "no", seed)
    options = FineTuning(settings, loss, garments, batch=batch, anchor=anchor)  # type: ignore[arg-type]
    with _stages() as stage:
        pipeline = fine_tune(load_pipeline(model), examples, out, options, validation, stage)
    _tell(out, [*pipeline.fine.values()])


@train.command()
def fc(
    dataset: DrapesOf,
    out: Out,
    epochs: Annotated[int, typer.Option("--epochs", min=1, help="Of each network.")] = 2000,
    batch: Batch = 16,
    learning_rate: Rate = 1e-3,
    precision: Precision = "no",
    seed: Seed = 0,
) -> None:
    """Train the fully-connected network on the one dense mesh, one a fabric: a rival of the graph networks.

    \b
    Examples:
      muslin train fc --dataset out/thesis_static --out out/fc
    """
    from muslin.learn.drape.fully_connected import train_fully_connected

    settings = _settings(epochs, learning_rate, precision, seed)
    with _stages() as stage:
        draper = train_fully_connected(_dense(dataset), out, settings, batch, stage("fc"))
    _tell(out, list(draper.networks.values()))


@train.command()
def ssch(
    dataset: DrapesOf,
    out: Out,
    design: Annotated[str, typer.Option("--design", metavar="NAME", help="The one design, by its label.")],
    epochs: Annotated[int, typer.Option("--epochs", min=1, help="Of each network.")] = 2000,
    batch: Batch = 16,
    learning_rate: Rate = 1e-2,
    precision: Precision = "no",
    seed: Seed = 0,
) -> None:
    """Train the static part of Santesteban et al. 2019: one garment, from body shape, one network a fabric.

    \b
    Examples:
      muslin train ssch --dataset out/thesis_static --design seen-s35-c110-l110 --out out/ssch
    """
    from muslin.learn.drape.fully_connected import train_single_garment
    from muslin.sim.dataset.selection import select

    (own,) = {
        tuple(sample.garment.parameters.items())
        for sample in select(dataset, where={"design": design, "topology": "source"})
    }
    settings = _settings(epochs, learning_rate, precision, seed)
    with _stages() as stage:
        draper = train_single_garment(_dense(dataset), dict(own), out, settings, batch, stage("ssch"))
    _tell(out, list(draper.networks.values()))


def _settings(epochs: int, learning_rate: float, precision: str, seed: int) -> Settings:
    from muslin.learn.training.loop import Settings
    from muslin.learn.training.machine import use_all_cores

    use_all_cores()
    return Settings(epochs, learning_rate, seed=seed, precision=precision)


def _dense(place: str) -> DenseDrapes:
    """The drapes of the split "train" that are on the template, or of all if there is no such split."""
    from muslin.learn.drape.dense import dense_drapes
    from muslin.learn.drape.examples import read_examples
    from muslin.learn.drape.smoothing import LENGTH
    from muslin.sim.dataset.selection import select

    dataset = select(place, where={"topology": "source"})
    training = dataset.split("train") if "train" in dataset.splits else dataset
    return dense_drapes(read_examples(training, LENGTH))


@contextmanager
def _stages() -> Iterator[Callable[[str], Callable[[float, int, str], None]]]:
    """stage(name) ends the progress bar of the stage before, and begins one."""
    from muslin.eval.cli.progress import progress_bar

    with ExitStack() as stack:

        def stage(name: str) -> Callable[[float, int, str], None]:
            stack.close()
            return stack.enter_context(progress_bar(name))

        yield stage


def _tell(out: Path, networks: Sequence[Any]) -> None:
    from muslin.learn.training.machine import count_weights

    typer.echo(f"{out}: {len(networks)} networks of {count_weights(networks):,} weights in all")
