"""What can be compared: datasets, samples, files of moving surfaces and folders of them."""

from __future__ import annotations

from collections.abc import Callable, Collection
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from muslin.eval.read.folder import sources_in
from muslin.eval.read.formats import read_file
from muslin.eval.read.options import ReadOptions, track_of
from muslin.eval.read.track import Frames, MovingSurface, Track
from muslin.garments.errors import InputError
from muslin.sim.dataset import store
from muslin.sim.dataset.reader import open_dataset
from muslin.sim.dataset.root import Root
from muslin.sim.dataset.sample import Sample
from muslin.sim.dataset.schema import HEADER, SAMPLES, SUFFIX


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


def open_subject(
    path: str | Path,
    fps: float | None = None,
    *,
    options: ReadOptions | None = None,
    ids: Collection[str] = (),
) -> Subject:
    """A dataset, one sample, a file of any format of `formats`, or a folder of such files.

    A folder holds one sequence of mesh files, or a file or subfolder a sample, each named as its sample.

    fps       short for ReadOptions(fps=fps): frames per second of files that do not say
    options   how files are read; datasets know all of that themselves
    ids       names of samples: a folder of mesh files named so holds drapes, not frames of one sequence
    Raises InputError if it is none of these.
    """
    root, how = Path(path), options or ReadOptions(fps=fps)
    if not root.exists():
        raise InputError(
            f"{root}: no such file or folder; give a dataset, a sample, a mesh or a folder of meshes"
        )
    if (root / HEADER).is_file():
        return _dataset(root)
    if root.name.endswith(SUFFIX) and root.parent.name == SAMPLES:
        sample_id = root.name.removesuffix(SUFFIX)
        dataset = open_dataset(root.parent.parent)
        # Not the keys of all its samples: a benchmark opens each of thousands so.
        key = _key(dataset.root, sample_id)
        return Subject(root, (sample_id,), {sample_id: key}, lambda i: _sample_track(dataset[i]))
    sources = {root.stem: lambda: read_file(root)} if root.is_file() else sources_in(root, frozenset(ids))

    def load(name: str) -> Track:
        return track_of(name, sources[name](), how)

    return Subject(root, tuple(sources), {name: ("file", name) for name in sources}, load)


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
            f"{prediction.path} and {truth.path} have no sample in common, neither by id "
            f"({prediction.ids[0]} …, {truth.ids[0]} …) nor by design, shape, fabric and motion; compare "
            "datasets made from one configuration, files named as the samples, or two single samples"
        )
    first, second = {a for a, _ in pairs}, {b for _, b in pairs}
    return pairs, [i for i in prediction.ids if i not in first], [i for i in truth.ids if i not in second]


def _dataset(path: Path) -> Subject:
    dataset = open_dataset(path)
    if not len(dataset):
        raise InputError(f"{path}: the dataset holds no sample; run `muslin generate` first")
    keys = {i: _key(dataset.root, i) for i in dataset.ids}
    return Subject(path, dataset.ids, keys, lambda i: _sample_track(dataset[i]))


def _sample_track(sample: Sample) -> Track:
    garments = [sample.frame_garment(t) for t in range(sample.num_frames)]
    body = None
    if len(sample.body_faces):
        body = MovingSurface(
            f"the body of {sample.id}" if sample.body is not None else f"the obstacle of {sample.id}",
            Frames(sample.num_frames, sample.body_vertices),
            sample.body_faces,
        )
    return Track(
        sample.id,
        Frames(sample.num_frames, sample.frame_positions),
        [garment.faces for garment in garments],
        garments,
        sample.fps,
        sample,
        body,
        units_known=True,
    )


def _key(root: Root, sample_id: str) -> tuple[Any, ...]:
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
