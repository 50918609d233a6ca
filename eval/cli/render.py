"""`muslin render`: pictures and movies."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from muslin.eval.cli.options import DatasetPlace, Force, SampleId, check_new
from muslin.garments.errors import InputError

if TYPE_CHECKING:
    from muslin.sim.dataset.reader import Dataset
    from muslin.sim.dataset.sample import Sample

SUFFIXES = (".png", ".gif", ".mp4")


def render(
    dataset: DatasetPlace,
    out: Annotated[Path, typer.Option("--out", metavar="FILE", help="FILE.png, .gif or .mp4.")],
    sample_id: SampleId = None,
    frame: Annotated[int, typer.Option("--frame", min=0, help="Of a sequence, for .png.")] = 0,
    size: Annotated[str, typer.Option("--size", metavar="WxH", help="Pixels.")] = "480x640",
    turn: Annotated[
        float, typer.Option("--turn", help="Degrees to walk round the wearer; 180 is the back.")
    ] = 0.0,
    force: Force = False,
) -> None:
    """Picture a dataset: .png one sample, or without --sample some of all; .gif and .mp4 a sequence.

    A drape as .gif or .mp4 is turned round once. No display and no graphics driver are needed.

    \b
    Examples:
      muslin render out/demo --out sheet.png
      muslin render out/demo --sample ID --turn 180 --size 900x1200 --out back.png
      muslin render out/walk --out walk.mp4
    """
    from muslin.sim.dataset.reader import open_dataset

    if out.suffix.lower() not in SUFFIXES:
        raise InputError(f"{out}: a picture or movie ends in {', '.join(SUFFIXES)}, not {out.suffix!r}")
    pixels = _size(size)
    data = open_dataset(dataset)
    if not len(data):
        raise InputError(f"{dataset}: the dataset holds no sample; run `muslin generate` first")
    check_new(out, force)
    if out.suffix.lower() == ".png":
        _still(data, out, sample_id, frame, pixels, turn)
    else:
        _movie(data[_moving(data, sample_id)], out, pixels)
    typer.echo(str(out))


def _size(text: str) -> tuple[int, int]:
    parts = text.lower().split("x")
    if len(parts) != 2 or not all(part.isdigit() and 16 <= int(part) <= 4096 for part in parts):
        raise InputError(f"--size {text!r}: must be WIDTHxHEIGHT, each 16 to 4096, for example 480x640")
    return int(parts[0]), int(parts[1])


def _moving(data: Dataset, sample_id: str | None) -> str:
    if sample_id is not None:
        return sample_id
    sequences = [row["id"] for row in data.rows if row["kind"] == "sequence"]
    return (sequences or list(data.ids))[0]


def _still(
    data: Dataset, out: Path, sample_id: str | None, frame: int, size: tuple[int, int], turn: float
) -> None:
    import io

    import numpy as np
    from PIL import Image

    from muslin.eval.cli.progress import progress_bar
    from muslin.eval.page import write_atomically
    from muslin.sim.view.overview import overview
    from muslin.sim.view.picture import AZIMUTH, picture

    azimuth = AZIMUTH + float(np.deg2rad(turn))
    if sample_id is None and len(data) > 1:
        with progress_bar("draw") as update:
            png = overview(data, azimuth, progress=update)
    else:
        sample = data[sample_id or 0]
        if frame >= sample.num_frames:
            raise InputError(f"--frame {frame}: sample {sample.id} has frames 0 to {sample.num_frames - 1}")
        image = picture(sample, frame, size, azimuth)
        stream = io.BytesIO()
        Image.fromarray(image).save(stream, "PNG")
        png = stream.getvalue()
    write_atomically(out, png)


def _movie(sample: Sample, out: Path, size: tuple[int, int]) -> None:
    from muslin.eval.cli.progress import progress_bar
    from muslin.sim.view.movie import TURNTABLE_FPS, frame_choice, movie_frames, turntable, write_movie

    with progress_bar("draw") as update:
        if sample.num_frames > 1:
            frames, fps = frame_choice(sample, fps=30.0 if out.suffix.lower() == ".mp4" else 15.0)
            pictures = movie_frames(sample, frames, size, progress=lambda done, n: update(done, n, ""))
        else:
            fps = TURNTABLE_FPS
            pictures = turntable(sample, size=size, progress=lambda done, n: update(done, n, ""))
    partial = out.with_name(f".{out.stem}.partial{out.suffix}")
    try:
        write_movie(partial, pictures, fps)
        partial.replace(out)
    finally:
        partial.unlink(missing_ok=True)
