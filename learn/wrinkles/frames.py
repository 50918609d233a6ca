"""What the models learn from: maps and conditions of every frame of a dataset's sequences."""

from __future__ import annotations

import io
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from hashlib import sha256
from pathlib import Path

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from muslin.garments.errors import InputError
from muslin.garments.mesh import GarmentMesh
from muslin.learn.drape.mean import MeanDrape
from muslin.learn.wrinkles.condition import Condition
from muslin.learn.wrinkles.garment import UnposedGarment, unposed_garment
from muslin.learn.wrinkles.templates import fit_templates
from muslin.learn.wrinkles.world import SequenceWorld
from muslin.sim.dataset import durable
from muslin.sim.dataset.reader import Dataset
from muslin.sim.dataset.sample import BodyTrack, Sample


@dataclass(frozen=True, eq=False)
class Told:
    """Conditions (T, C) and fields (T, F, side, side) of the frames of a sequence, see `Condition`."""

    conditions: Tensor
    fields: Tensor

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


def world_of(dataset: Dataset) -> SequenceWorld:
    """That of the first sequence of a dataset, with the fabrics of all.

    Raises InputError if there is none, or it is on no parametric body.
    """
    if not len(dataset):
        raise InputError(f"{dataset.root}: no sequence is left to learn from")
    sample = dataset[0]
    if sample.body is None or sample.fps is None:
        raise InputError(
            f"sample {sample.id} is no sequence on a parametric body; select sequences on one (`muslin info`)"
        )
    fabrics = tuple(dict.fromkeys(row["fabric"] for row in dataset.rows))
    return SequenceWorld(
        sample.frame_garment(0).name, sample.body.model, sample.body.digest, fabrics, sample.fps
    )


def varied_parameters(samples: Iterable[Sample]) -> tuple[str, ...]:
    """Names of the design parameters that are not the same in all samples."""
    found = [sample.frame_garment(0).parameters for sample in samples]
    return tuple(name for name, value in found[0].items() if any(own[name] != value for own in found))


def used_betas(samples: Iterable[Sample]) -> int:
    """Number of shape coefficients up to the last that some sample uses, at least one."""
    used = [np.flatnonzero(sample.body.beta) for sample in samples if sample.body is not None]
    return max((int(own.max()) + 1 for own in used if len(own)), default=1)


def templates_of(samples: Sequence[Sample], world: SequenceWorld, seed: int = 0) -> MeanDrape:
    """G_design of sequences."""
    designs: dict[tuple[float, ...], list[Sample]] = {}
    for sample in samples:
        world.check(sample)
        designs.setdefault(tuple(sample.garment.parameters.values()), []).append(sample)
    return fit_templates([*designs.values()], varied_parameters(samples), world.load_body(), seed)


class GarmentCache:
    """Unposed garments, each made once a design and triangulation."""

    def __init__(self, network: MeanDrape, world: SequenceWorld, size: int, places: int) -> None:
        self.network, self.world, self.body = network, world, world.load_body()
        self.size, self.places = size, places
        self._known: dict[str, UnposedGarment] = {}

    def of(self, mesh: GarmentMesh) -> UnposedGarment:
        key = sha256(mesh.panel_vertices.tobytes() + mesh.panel_faces.tobytes()).hexdigest()
        if key not in self._known:
            self._known[key] = unposed_garment(mesh, self.network, self.body, self.size, self.places)
        return self._known[key]


def told_of(garment: UnposedGarment, track: BodyTrack, fabric: str, condition: Condition, fps: float) -> Told:
    """What is told of a garment on a moving body."""
    conditions = condition.of(track, fps, garment.mesh.parameters, fabric)
    side = garment.places.layout.size
    fields = garment.fields(track, fps) if condition.fields else np.zeros((len(conditions), 0, side, side))
    return Told(conditions, torch.from_numpy(fields.astype(np.float32)))


def read_clips(
    dataset: Dataset,
    garments: GarmentCache,
    condition: Condition,
    folder: Path | None = None,
    progress: Callable[[float, int, str], None] | None = None,
) -> list[Clip]:
    """Every sequence of a dataset; its maps, with a folder, kept there and read when asked for again.

    Raises InputError for a sample of another world.
    """
    world = garments.world
    clips = []
    for done, sample in enumerate(dataset):
        track = world.check(sample)
        garment = garments.of(sample.frame_garment(0))
        if folder is None:
            maps = garment.maps(sample.positions, track)
        else:
            maps = _kept_maps(garment, sample, track, folder, garments.network)
        clips.append(Clip(sample.id, maps, told_of(garment, track, sample.fabric, condition, world.fps)))
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
            sha.update(clip.told.conditions.numpy().tobytes() + clip.told.fields.numpy().tobytes())
    return sha.hexdigest()


def _kept_maps(
    garment: UnposedGarment, sample: Sample, track: BodyTrack, folder: Path, templates: MeanDrape
) -> NDArray[np.float32]:
    """Maps from a file whose name says of what they are, made first if it is not there."""
    weights = b"".join(value.numpy().tobytes() for value in templates.state_dict().values())
    size = str(garment.codec.layout.size).encode()
    file = folder / f"{sha256(weights + sample.positions.tobytes() + size).hexdigest()[:24]}.npy"
    if not file.exists():
        durable.make_folder(folder)
        stream = io.BytesIO()
        np.save(stream, garment.maps(sample.positions, track), allow_pickle=False)
        durable.write_file(file, stream.getvalue())
    maps: NDArray[np.float32] = np.load(file, mmap_mode="r")
    return maps
