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


Epochs = Annotated[int, typer.Option("--epochs", min=1, help="Of each network.")]
FabricInput = Annotated[
    bool, typer.Option("--fabric-input", help="One R_fine that sees the fabric, not one a fabric.")
]
Order = Annotated[int, typer.Option("--order", min=1, help="K of the Chebyshev polynomials.")]
Skinned = Annotated[
    bool,
    typer.Option(
        "--skinned/--from-mean", help="Start from the mean drape as the skin carries it, or as it is."
    ),
]


@train.command()
def drape(
    dataset: DrapesOf,
    out: Out,
    epochs: Epochs = 60,
    batch: Batch = 8,
    learning_rate: Rate = 3e-3,
    order: Order = 3,
    fabric_input: FabricInput = False,
    skinned: Skinned = True,
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
    from muslin.learn.drape.train import DrapeSettings, train_pipeline
    from muslin.sim.dataset.reader import open_dataset

    each = _settings(epochs, learning_rate, precision, seed)
    settings = DrapeSettings(each, each, order=order, batch=batch, fabric_input=fabric_input, skinned=skinned)
    with _stages() as stage:
        pipeline = train_pipeline(open_dataset(dataset), out, settings, stage)
    _tell(out, [pipeline.smooth, *pipeline.fine.values()])


@train.command()
def smooth(
    dataset: DrapesOf,
    out: Out,
    epochs: Epochs = 60,
    batch: Batch = 8,
    learning_rate: Rate = 3e-3,
    order: Order = 3,
    skinned: Skinned = True,
    precision: Precision = "no",
    seed: Seed = 0,
) -> None:
    """Train the first stages of `muslin train drape` alone: R_mean and R_smooth.

    \b
    Examples:
      muslin train smooth --dataset out/thesis_static --out out/pipeline --epochs 120
    """
    from muslin.learn.drape.train import DrapeSettings, read_splits, train_smooth
    from muslin.sim.dataset.reader import open_dataset

    each = _settings(epochs, learning_rate, precision, seed)
    settings = DrapeSettings(each, order=order, batch=batch, skinned=skinned)
    with _stages() as stage:
        pipeline = train_smooth(read_splits(open_dataset(dataset)), out, settings, stage)
    _tell(out, [pipeline.smooth])


@train.command()
def fine(
    dataset: DrapesOf,
    out: Annotated[Path, typer.Option("--out", metavar="DIR", help="What `muslin train smooth` wrote.")],
    epochs: Epochs = 60,
    batch: Batch = 8,
    learning_rate: Rate = 3e-3,
    fabric_input: FabricInput = False,
    precision: Precision = "no",
    seed: Seed = 0,
) -> None:
    """Train the last stage of `muslin train drape` alone: R_fine, on what R_smooth says.

    \b
    Examples:
      muslin train fine --dataset out/thesis_static --out out/pipeline --epochs 40
    """
    from muslin.learn.drape.pipeline import GRAPHS, load_pipeline
    from muslin.learn.drape.train import DrapeSettings, read_splits, train_fine
    from muslin.sim.dataset.reader import open_dataset

    each = _settings(epochs, learning_rate, precision, seed)
    settings = DrapeSettings(fine=each, batch=batch, fabric_input=fabric_input)
    pipeline = load_pipeline(out, out / GRAPHS)
    with _stages() as stage:
        pipeline = train_fine(pipeline, read_splits(open_dataset(dataset)), out, settings, stage)
    _tell(out, [*pipeline.fine.values()])


@train.command()
def wrinkles(
    dataset: Annotated[str, typer.Option("--dataset", metavar="DIR", help="Sequences: a folder or a URL.")],
    out: Out,
    epochs: Epochs = 40,
    kind: Annotated[
        str, typer.Option("--kind", help="temporal (sees the frame before) or static.")
    ] = "temporal",
    process: Annotated[
        str, typer.Option("--process", help="epsilon or v (diffusion), flow, or regression (one step).")
    ] = "flow",
    network: Annotated[
        str, typer.Option("--network", help="tiny, small, medium or thesis: 0.4 to 114 million weights.")
    ] = "small",
    size: Annotated[int, typer.Option("--size", help="Texels along a side of the maps.")] = 128,
    pose: Annotated[bool, typer.Option("--pose/--no-pose", help="Told the pose of the body.")] = True,
    motion: Annotated[
        bool, typer.Option("--motion/--no-motion", help="Told how fast the body moves and turns.")
    ] = True,
    fields: Annotated[
        bool, typer.Option("--fields/--no-fields", help="Told at every place what acts on the cloth there.")
    ] = True,
    fabric_input: Annotated[bool, typer.Option("--fabric-input", help="Told the fabric.")] = False,
    mirror: Annotated[
        bool, typer.Option("--mirror/--no-mirror", help="Learn from mirror images as well.")
    ] = True,
    batch: Annotated[int, typer.Option("--batch", min=1, help="Frames in a batch.")] = 8,
    learning_rate: Rate = 1e-3,
    precision: Precision = "no",
    seed: Seed = 0,
) -> None:
    """Train a network that draws the displacement maps of animated garments, on the split "train".

    Stop it at any moment; the same command goes on. DIR/train has logs for TensorBoard, loss curves and
    pictures.

    \b
    Examples:
      muslin train wrinkles --dataset out/thesis_animated --out out/temporal
      muslin train wrinkles --dataset out/thesis_animated --kind static --process epsilon --out out/static
      muslin train wrinkles --dataset out/thesis_animated --network thesis --process epsilon --no-motion \\
        --no-fields --out out/thesis
    """
    from muslin.learn.wrinkles.train import WrinkleSettings, train_wrinkles
    from muslin.sim.dataset.reader import open_dataset

    if kind not in ("temporal", "static"):
        raise InputError(f"--kind {kind}: must be temporal or static")
    settings = WrinkleSettings(
        _settings(epochs, learning_rate, precision, seed),
        kind == "temporal", process, network, size, pose, motion, fabric_input, fields, mirror, batch,
    )  # fmt: skip
    with _stages() as stage:
        model = train_wrinkles(open_dataset(dataset), out, settings, stage)
    _tell(out, [model.network])


@train.command()
def collisions(
    model: Annotated[Path, typer.Argument(metavar="MODEL_DIR", help="A pipeline of `muslin train drape`.")],
    dataset: DrapesOf,
    out: Out,
    epochs: Epochs = 20,
    loss: Annotated[
        str, typer.Option("--loss", metavar="KIND", help="distance (exact), or nearest-vertex (the thesis').")
    ] = "distance",
    garments: Annotated[int, typer.Option("--garments", min=1, help="Random ones that it learns on.")] = 48,
    anchor: Annotated[
        float, typer.Option("--anchor", min=0.0, help="Weight of staying what it was; the thesis: 0.")
    ] = 0.008,
    batch: Batch = 4,
    learning_rate: Rate = 1e-3,
    seed: Seed = 0,
) -> None:
    """Fine-tune R_fine against penetration: random garments on random bodies, and no simulation.

    The dataset says between which designs the random ones lie, and on which the share of vertices inside the
    body is logged.

    \b
    Examples:
      muslin train collisions out/pipeline --dataset out/thesis_static --out out/tuned
    """
    from muslin.learn.drape.fine_tune import FineTuning, fine_tune
    from muslin.learn.drape.pipeline import load_pipeline
    from muslin.learn.drape.train import read_splits
    from muslin.sim.dataset.reader import open_dataset

    if loss not in ("distance", "nearest-vertex"):
        raise InputError(f"--loss {loss}: must be distance or nearest-vertex")
    sets = read_splits(open_dataset(dataset))
    examples = sets.pop("train")
    settings = _settings(epochs, learning_rate, "no", seed)
    options = FineTuning(settings, loss, garments, batch=batch, anchor=anchor)  # type: ignore[arg-type]
    with _stages() as stage:
        pipeline = fine_tune(load_pipeline(model), examples, out, options, sets, stage)
    _tell(out, [*pipeline.fine.values()])


@train.command()
def fc(
    dataset: DrapesOf,
    out: Out,
    epochs: Epochs = 2000,
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
    epochs: Epochs = 2000,
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

    own = select(dataset, where={"design": design, "topology": "source"})[0].garment.parameters
    settings = _settings(epochs, learning_rate, precision, seed)
    with _stages() as stage:
        draper = train_single_garment(_dense(dataset), own, out, settings, batch, stage("ssch"))
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
    from muslin.sim.dataset.selection import select

    dataset = select(place, where={"topology": "source"})
    training = dataset.split("train") if "train" in dataset.splits else dataset
    return dense_drapes(read_examples(training))


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
