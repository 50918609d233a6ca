"""Moving pictures of sequences, and turntables of drapes."""

from __future__ import annotations

import io
from collections.abc import Callable, Sequence
from pathlib import Path

import imageio.v3 as imageio
import numpy as np
from PIL import Image

from muslin.garments.errors import InputError
from muslin.sim.dataset.sample import Sample
from muslin.sim.view.lighting import DRAFT, Quality
from muslin.sim.view.picture import AZIMUTH, picture, sample_cameras

Progress = Callable[[int, int], None]
TURNTABLE_FRAMES = 36
TURNTABLE_FPS = 12.0


def frame_choice(
    sample: Sample, fps: float | None = None, most: int | None = None
) -> tuple[list[int], float]:
    """Frames to show and the rate to show them at, frames per second: never faster or slower than the motion.

    fps    rate wanted; the file's rate, thinned by a whole number, that comes nearest from above is taken
    most   number of frames not to exceed, by thinning further
    """
    own = sample.fps or 1.0
    step = max(1, int(own // fps)) if fps else 1
    if most is not None:
        step = max(step, -(-sample.num_frames // most))
    return list(range(0, sample.num_frames, step)), own / step


def movie_frames(
    sample: Sample,
    frames: Sequence[int],
    size: tuple[int, int] = (360, 480),
    quality: Quality = DRAFT,
    progress: Progress | None = None,
) -> list[np.ndarray]:
    """Pictures of the frames by a camera that walks beside the wearer."""
    cameras, ground = sample_cameras(sample, frames, size)
    pictures = []
    for i, (frame, camera) in enumerate(zip(frames, cameras, strict=True)):
        pictures.append(picture(sample, frame, size, quality=quality, camera=camera, ground=ground))
        if progress is not None:
            progress(i + 1, len(frames))
    return pictures


def turntable(
    sample: Sample,
    count: int = TURNTABLE_FRAMES,
    size: tuple[int, int] = (360, 480),
    quality: Quality = DRAFT,
    progress: Progress | None = None,
) -> list[np.ndarray]:
    """The first frame seen from all around."""
    pictures = []
    for i in range(count):
        pictures.append(picture(sample, 0, size, AZIMUTH + 2.0 * np.pi * i / count, quality=quality))
        if progress is not None:
            progress(i + 1, count)
    return pictures


def gif_bytes(pictures: Sequence[np.ndarray], fps: float) -> bytes:
    """An endless GIF with one palette for all frames, so that still areas do not flicker.

    GIF keeps time in hundredths of a second; each frame's duration is rounded so that the sum stays right.
    """
    if not pictures:
        raise InputError("movie: no frames; give one picture or more")
    palette = Image.fromarray(np.concatenate(pictures[:: max(1, len(pictures) // 6)])).quantize(255)
    images = [Image.fromarray(p).quantize(palette=palette, dither=Image.Dither.NONE) for p in pictures]
    edges = np.rint(100.0 * np.arange(len(images) + 1) / fps).astype(int)
    durations = [int(10 * max(2, d)) for d in np.diff(edges)]
    stream = io.BytesIO()
    images[0].save(
        stream, "GIF", save_all=True, append_images=images[1:], duration=durations, loop=0, optimize=False
    )
    return stream.getvalue()


def write_movie(path: Path, pictures: Sequence[np.ndarray], fps: float) -> None:
    """Write pictures as .gif or .mp4 (H.264). Raises InputError for another ending."""
    if path.suffix.lower() == ".gif":
        path.write_bytes(gif_bytes(pictures, fps))
    elif path.suffix.lower() == ".mp4":
        even = [p[: p.shape[0] // 2 * 2, : p.shape[1] // 2 * 2] for p in pictures]
        imageio.imwrite(
            path, np.stack(even), plugin="FFMPEG", fps=fps, codec="libx264", macro_block_size=2, quality=8
        )
    else:
        raise InputError(f"{path}: a movie ends in .gif or .mp4, not {path.suffix!r}")
