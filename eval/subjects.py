"""What can be compared: datasets, samples, mesh files and folders of meshes, as moving surfaces."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from muslin.eval.meshes import MESH_SUFFIXES, read_frames
from muslin.garments.errors import InputError
from muslin.garments.mesh import GarmentMesh
from muslin.sim.dataset import store
from muslin.sim.dataset.reader import open_dataset
from muslin.sim.dataset.sample import Sample
from muslin.sim.dataset.schema import HEADER, SAMPLES, SUFFIX


@dataclass(frozen=True, eq=False)
class Track:
    """One moving surface, whose topology may change over time.

    positions   a frame: (V_t, 3), metres
    faces       a frame: (F_t, 3); frames of one topology share one object
    garments    a frame: its mesh with panels; empty where panels are not known
    sample      what it came from, if it was one
    """

    name: str
    positions: Sequence[np.ndarray]
    faces: Sequence[np.ndarray]
    garments: Sequence[GarmentMesh] = ()
    fps: float | None = None
    sample: Sample | None = None

    @property
    def num_frames(self) -> int:
        return len(self.positions)


@dataclass(frozen=True)
class Subject:
    """One side of a comparison.

    ids    names of its tracks
    keys   {id: what the track shows}: equal keys on both sides mean the same garment, body, fabric and motion
    load   reads a track by id
    """

    path: Path
    ids: tuple[str, ...]
    keys: dict[str, tuple[Any, ...]]
    load: Callable[[str], Track]


def open_subject(path: str | Path, fps: float | None = None) -> Subject:
    """A dataset, one sample, a folder of mesh files (a sequence, in order of name), or a mesh file.

    fps    frames per second of a folder of mesh files; None leaves velocities out
    Raises InputError if it is none of these.
    """
    root = Path(path)
    if not root.exists():
        raise InputError(
            f"{root}: no such file or folder; give a dataset, a sample, a mesh or a folder of meshes"
        )
    if (root / HEADER).is_file():
        return _dataset(root)
    if root.name.endswith(SUFFIX) and root.parent.name == SAMPLES:
        sample_id = root.name.removesuffix(SUFFIX)
        dataset = _dataset(root.parent.parent)
        return Subject(root, (sample_id,), {sample_id: dataset.keys[sample_id]}, dataset.load)
    files = [root] if root.is_file() else _mesh_files(root)

    def load(name: str) -> Track:
        frames = read_frames(files)
        known = [frame.garment for frame in frames if frame.garment is not None]
        return Track(
            name,
            [frame.vertices for frame in frames],
            [frame.faces for frame in frames],
            known if len(known) == len(frames) else (),
            fps if len(files) > 1 else None,
        )

    return Subject(root, (root.stem,), {root.stem: ("mesh",)}, load)


def matched(prediction: Subject, truth: Subject) -> tuple[list[tuple[str, str]], list[str], list[str]]:
    """Pairs (prediction id, truth id), and the ids left over on either side.

    By equal id where there is one, else by equal key; a single track on both sides is a pair in any case.
    Raises InputError if nothing matches.
    """
    if len(prediction.ids) == 1 and len(truth.ids) == 1:
        return [(prediction.ids[0], truth.ids[0])], [], []
    known = set(truth.ids)
    pairs = [(i, i) for i in prediction.ids if i in known]
    used = {i for i, _ in pairs}
    by_key = {truth.keys[i]: i for i in truth.ids if i not in used}
    for i in prediction.ids:
        if i not in known and prediction.keys[i] in by_key:
            pairs.append((i, by_key.pop(prediction.keys[i])))
    if not pairs:
        raise InputError(
            f"{prediction.path} and {truth.path} have no sample in common, neither by id nor by design, "
            "shape, fabric and motion; compare datasets made from one configuration, or two single samples"
        )
    first, second = {a for a, _ in pairs}, {b for _, b in pairs}
    return pairs, [i for i in prediction.ids if i not in first], [i for i in truth.ids if i not in second]


def _dataset(root: Path) -> Subject:
    dataset = open_dataset(root)
    if not len(dataset):
        raise InputError(f"{root}: the dataset holds no sample; run `muslin generate` first")

    def load(sample_id: str) -> Track:
        sample = dataset[sample_id]
        frames = range(sample.num_frames)
        garments = [sample.frame_garment(t) for t in frames]
        positions = [sample.frame_positions(t) for t in frames]
        return Track(sample_id, positions, [g.faces for g in garments], garments, sample.fps, sample)

    return Subject(root, dataset.ids, {i: _key(root, i) for i in dataset.ids}, load)


def _key(root: Path, sample_id: str) -> tuple[Any, ...]:
    meta, arrays = store.read_meta(root, sample_id)
    beta = store.read_array(root, sample_id, "beta") if "beta" in arrays else np.zeros(0)
    garment = meta["garment"]
    return (
        meta["kind"],
        garment["name"],
        tuple(sorted((key, round(value, 6)) for key, value in garment["parameters"].items())),
        tuple(np.trim_zeros(np.round(beta, 6) + 0.0, "b").tolist()),
        meta["fabric"],
        meta["labels"].get("sequence", ""),
    )


def _mesh_files(folder: Path) -> list[Path]:
    files = sorted(p for p in folder.iterdir() if p.suffix.lower() in MESH_SUFFIXES)
    if not files:
        raise InputError(
            f"{folder}: neither a dataset (no {HEADER}) nor a folder of meshes ({', '.join(MESH_SUFFIXES)})"
        )
    return files
