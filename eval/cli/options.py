"""Options that several commands share, and the checks on them."""

from __future__ import annotations

import re
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from muslin.garments.errors import InputError

if TYPE_CHECKING:
    from muslin.sim.dataset.engine import Cluster

Overrides = Annotated[
    list[str] | None,
    typer.Option(
        "--set", metavar="KEY=VALUE", help="Change a key of the file, e.g. --set seed=3. Repeatable."
    ),
]
Device = Annotated[str, typer.Option("--device", help="cpu, or cuda:0 (cuda:1 …).")]
Workers = Annotated[
    int | None, typer.Option("--workers", min=1, help="Processes; by default one a processor core.")
]
Scheduler = Annotated[
    str | None,
    typer.Option("--scheduler", metavar="ADDRESS", help="Use the workers of this dask scheduler instead."),
]
Memory = Annotated[
    str,
    typer.Option("--memory", metavar="SIZE", help="Of a worker, such as 4GB; by default an equal share."),
]
Retries = Annotated[
    int, typer.Option("--retries", min=0, help="Tries more for samples over which a worker died.")
]
DatasetPlace = Annotated[
    str, typer.Argument(metavar="DIR", help="The dataset: a folder, or a URL such as s3://bucket/name.")
]
SampleId = Annotated[
    str | None, typer.Option("--sample", metavar="ID", help="The sample; see `muslin info DIR --samples`.")
]
Where = Annotated[
    list[str] | None,
    typer.Option(
        "--where",
        metavar="KEY=VALUE",
        help="Only samples like this, e.g. design=tshirt, or sequence=walk*. Repeatable.",
    ),
]
Force = Annotated[bool, typer.Option("--force", help="Replace the output if it is there.")]


def check_device(device: str) -> str:
    """Raise InputError unless the name is one of a device."""
    if not re.fullmatch(r"cpu|cuda(:\d+)?", device):
        raise InputError(f"--device {device!r} is not allowed; it must be cpu or cuda:0 (cuda:1 …)")
    return "cuda:0" if device == "cuda" else device


def cluster_of(workers: int | None, scheduler: str | None, memory: str, retries: int) -> Cluster:
    """The cluster that the options ask for. Raises InputError for options that exclude each other."""
    from muslin.sim.dataset.engine import Cluster

    if scheduler is not None and workers is not None:
        raise InputError("--workers and --scheduler exclude each other: a scheduler has workers of its own")
    return Cluster(workers, scheduler, memory, retries)


def check_new(path: Path, force: bool = False) -> Path:
    """Raise InputError if a file is there already (unless forced), or its folder cannot be made."""
    if path.is_dir():
        raise InputError(f"{path} is a folder; give the name of a file")
    if path.exists() and not force:
        raise InputError(f"{path} is there already; give another name, or --force to replace it")
    return make_parent(path)


def make_parent(path: Path) -> Path:
    """Make the folder that a file is to lie in. Raises InputError if that cannot be."""
    if path.is_dir():
        raise InputError(f"{path} is a folder; give the name of a file")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError(f"{path.parent}: cannot be made ({error.strerror}); choose another place") from error
    return path


def check_place(path: Path) -> None:
    """Raise InputError unless a folder can be made there: found out before long work, not after it."""
    if not path.is_dir():
        make_parent(path / "sample")
        path.rmdir()


def check_empty_folder(path: Path) -> Path:
    """Raise InputError if a folder for new output holds anything."""
    if path.is_file() or (path.is_dir() and any(path.iterdir())):
        raise InputError(f"{path} is not an empty folder; give a new one: nothing there is touched")
    return path


def conditions_of(where: list[str] | None) -> dict[str, str]:
    """{key: value} of `Where`. Raises InputError for what is no KEY=VALUE."""
    pairs = [entry.partition("=") for entry in where or []]
    for key, equals, value in pairs:
        if not (key and equals):
            raise InputError(f"--where {key}{equals}{value}: must be KEY=VALUE, e.g. design=tshirt")
    return {key: value for key, _, value in pairs}
