"""What the models learn from: maps and conditions of every frame of a dataset's sequences."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from hashlib import sha256
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from torch import Tensor

from muslin.garments.errors import InputError
from muslin.learn.drape.mean import MeanDrape
from muslin.learn.wrinkles.condition import Condition
from muslin.learn.wrinkles.garment import UnposedGarment, unposed_garment
from muslin.learn.wrinkles.templates import fit_templates
from muslin.learn.wrinkles.world import SequenceWorld
from muslin.sim.dataset import durable
from muslin.sim.dataset.reader import Dataset
from muslin.sim.dataset.sample import Sample


@dataclass(frozen=True, eq=False)
class Clip:
    """One sequence: maps (T, N, 3), metres, in memory or a file; conditions (T, C)."""

    id: str
    maps: NDArray[np.float32]
    conditions: Tensor

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

    def __init__(self, network: MeanDrape, world: SequenceWorld, size: int) -> None:
        self.network, self.body, self.size = network, world.load_body(), size
        self._known: dict[str, UnposedGarment] = {}

    def of(self, sample: Sample) -> UnposedGarment:
        mesh = sample.frame_garment(0)
        key = sha256(mesh.panel_vertices.tobytes() + mesh.panel_faces.tobytes()).hexdigest()
        if key not in self._known:
            self._known[key] = unposed_garment(mesh, self.network, self.body, self.size)
        return self._known[key]


def read_clips(
    dataset: Dataset,
    garments: GarmentCache,
    world: SequenceWorld,
    condition: Condition,
    folder: Path,
    progress: Callable[[float, int, str], None] | None = None,
) -> list[Clip]:
    """Every sequence of a dataset, its maps kept in `folder`, from where they are read when asked for again.

    Raises InputError for a sample of another world.
    """
    durable.make_folder(folder)
    weights = b"".join(value.numpy().tobytes() for value in garments.network.state_dict().values())
    clips = []
    for done, sample in enumerate(dataset):
        track = world.check(sample)
        key = sha256(weights + sample.positions.tobytes() + str(garments.size).encode()).hexdigest()[:24]
        file = folder / f"{key}.npy"
        if not file.exists():
            _store(file, garments.of(sample).maps(sample.positions, track))
        maps = np.load(file, mmap_mode="r")
        conditions = condition.of(track, world.fps, sample.garment.parameters, sample.fabric)
        clips.append(Clip(sample.id, maps, conditions))
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
            sha.update(clip.conditions.numpy().tobytes())
    return sha.hexdigest()


def _store(file: Path, maps: NDArray[np.float32]) -> None:
    import io

    stream = io.BytesIO()
    np.save(stream, maps, allow_pickle=False)
    durable.write_file(file, stream.getvalue())
