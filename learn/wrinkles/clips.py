"""What the models learn from: maps and conditions of every frame of a dataset's sequences."""

from __future__ import annotations

import io
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from hashlib import sha256
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from muslin.learn.wrinkles.condition import Condition
from muslin.learn.wrinkles.garment import GarmentCache, UnposedGarment
from muslin.learn.wrinkles.mirror import mirrored_track
from muslin.sim.dataset import durable
from muslin.sim.dataset.reader import Dataset
from muslin.sim.dataset.sample import BodyTrack, Sample

KEPT = 1
"""Part of the names of files: another number, whenever maps or fields come to mean something else."""


@dataclass(frozen=True, eq=False)
class Told:
    """Conditions (T, C) and fields (T, F, side, side) of the frames of a sequence, see `Condition`."""

    conditions: NDArray[np.float32]
    fields: NDArray[np.float32]

    def __len__(self) -> int:
        return len(self.conditions)


@dataclass(frozen=True, eq=False)
class Clip:
    """One sequence: maps (T, N, 3), metres, in memory or a file; and what is told of its frames."""

    id: str
    maps: NDArray[np.float32]
    told: Told

    def __len__(self) -> int:
        return len(self.maps)


def told_of(garment: UnposedGarment, track: BodyTrack, fabric: str, condition: Condition, fps: float) -> Told:
    """What is told of a garment on a moving body."""
    conditions = condition.of(track, fps, garment.mesh.parameters, fabric).numpy()
    return Told(conditions, _fields(garment, track, condition, fps))


def _fields(
    garment: UnposedGarment, track: BodyTrack, condition: Condition, fps: float
) -> NDArray[np.float32]:
    if condition.fields:
        return garment.fields(track, fps)
    side = garment.places.layout.size
    return np.zeros((len(track.poses), 0, side, side), np.float32)


def read_clips(
    dataset: Dataset,
    garments: GarmentCache,
    condition: Condition,
    folder: Path | None = None,
    progress: Callable[[float, int, str], None] | None = None,
    *,
    mirror: bool = False,
) -> list[Clip]:
    """Every sequence of a dataset; its maps and fields, with a folder, kept there for another time.

    mirror: after each its mirror image. Raises InputError for a sample of another world.
    """
    world = garments.world
    clips = []
    for done, sample in enumerate(dataset):
        track = world.check(sample)
        garment = garments.of(sample.frame_garment(0))
        clips.append(_clip(garment, sample, track, False, condition, world.fps, folder))
        if mirror:
            clips.append(_clip(garment, sample, track, True, condition, world.fps, folder))
        if progress is not None:
            progress(done + 1, len(dataset), f"maps of {sample.id}")
    return clips


def digest_of(clips: Mapping[str, Sequence[Clip]]) -> str:
    """Of all that is learned from: another one is another training."""
    sha = sha256()
    for name, own in clips.items():
        sha.update(name.encode())
        for clip in own:
            sha.update(np.ascontiguousarray(clip.maps).data)
            sha.update(clip.told.conditions.tobytes())
            sha.update(np.ascontiguousarray(clip.told.fields).data)
    return sha.hexdigest()


def _clip(
    garment: UnposedGarment,
    sample: Sample,
    track: BodyTrack,
    mirror: bool,
    condition: Condition,
    fps: float,
    folder: Path | None,
) -> Clip:
    moved = mirrored_track(track, garment.skin.model) if mirror else track
    encode = garment.mirrored_maps if mirror else garment.maps
    size, places = garment.codec.layout.size, garment.places.layout.size
    key = sha256(repr((KEPT, size, places, condition.fields, fps, mirror)).encode())
    for values in (garment.template, sample.positions, track.beta, track.poses, track.translations):
        key.update(np.ascontiguousarray(values).data)
    stem = key.hexdigest()[:24]
    maps = _kept(folder, f"{stem}-maps.npy", partial(encode, sample.positions, track))
    fields = _kept(folder, f"{stem}-fields.npy", partial(_fields, garment, moved, condition, fps))
    conditions = condition.of(moved, fps, garment.mesh.parameters, sample.fabric).numpy()
    return Clip(f"{sample.id}-mirrored" if mirror else sample.id, maps, Told(conditions, fields))


def _kept(folder: Path | None, name: str, make: Callable[[], NDArray[np.float32]]) -> NDArray[np.float32]:
    """What a file of a folder has, mapped into memory, made first if it is not there; without a folder what
    is made."""
    if folder is None:
        return make()
    file = folder / name
    if not file.exists():
        durable.make_folder(folder)
        stream = io.BytesIO()
        np.save(stream, make(), allow_pickle=False)
        durable.write_file(file, stream.getvalue())
    values: NDArray[np.float32] = np.load(file, mmap_mode="r")
    return values
