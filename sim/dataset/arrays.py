"""Samples and frames as plain dictionaries of NumPy arrays, for code that knows nothing of muslin.

| key | type, shape | meaning |
| --- | --- | --- |
| `sample`, `split`, `kind`, `design`, `shape`, `sequence`, `fabric` | str | id, split and labels |
| `fps` | float | frames per second, 0 for a drape |
| `positions` | float32 (T, V, 3) | the cloth, metres |
| `faces` | int32 (F, 3) | sewn triangles |
| `panel_faces` | int32 (F, 3) | the same triangles, indexing `panel_vertices` |
| `panel_vertices` | float64 (P, 2) | panel space, in which the cloth is unstrained, metres |
| `panel_to_vertex` | int32 (P,) | sewn vertex of each panel vertex |
| `face_panel` | int32 (F,) | panel of each triangle |
| `uv` | float64 (P, 2) | layout in [0, 1]^2 shared by the designs of a family |
| `beta` | float64 (n,) | body shape, standard deviations |
| `poses`, `translations` | float64 (T, 24, 3), (T, 3) | axis-angle, radians; metres |
| `body_vertices`, `body_faces` | float32 (T, N, 3), int32 (M, 3) | on demand: what the cloth lies on, m |

One frame has `frame` (int), `positions` (V, 3), `pose` (24, 3), `translation` (3,), `body_vertices` (N, 3)
instead. What a sample does not have (`beta` without a parametric body, say) is absent. In a sample whose
topology changes, `positions` and the six arrays of the garment are tuples with an entry for every frame.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from muslin.garments.mesh import GarmentMesh
from muslin.sim.dataset.reader import Dataset
from muslin.sim.dataset.remeshed import RemeshedSequence
from muslin.sim.dataset.sample import Sample
from muslin.sim.dataset.schema import GARMENT_ARRAYS
from muslin.sim.dataset.selection import select

Arrays = dict[str, Any]
LABELS = ("design", "shape", "sequence")


def load_samples(
    dataset: Dataset | str | Path,
    split: str | None = None,
    where: Mapping[str, Any] | None = None,
    *,
    body: bool = False,
) -> Iterator[Arrays]:
    """The arrays of one sample after the other; `split`, `where` and errors as in `selection.select`."""
    chosen = select(dataset, split, where)
    return (sample_arrays(sample, body=body) for sample in chosen)


def load_frames(
    dataset: Dataset | str | Path,
    split: str | None = None,
    where: Mapping[str, Any] | None = None,
    *,
    body: bool = False,
) -> Iterator[Arrays]:
    """The arrays of one frame after the other, each sample read once; arguments as of `load_samples`."""
    chosen = select(dataset, split, where)
    return (frame_arrays(sample, frame, body=body) for sample in chosen for frame in range(sample.num_frames))


def sample_arrays(sample: Sample, *, body: bool = False) -> Arrays:
    """All frames of a sample. Raises InputError if `body` is asked for and its model is not there."""
    frames = range(sample.num_frames)
    if isinstance(sample, RemeshedSequence):
        garments = [_garment(sample.frame_garment(frame)) for frame in frames]
        cloth: Arrays = {name: tuple(arrays[name] for arrays in garments) for name in GARMENT_ARRAYS}
        cloth["positions"] = sample.frames
    else:
        cloth = {"positions": sample.positions} | _garment(sample.garment)
    arrays = _facts(sample) | cloth
    if sample.body is not None:
        arrays |= {
            "beta": sample.body.beta,
            "poses": sample.body.poses,
            "translations": sample.body.translations,
        }
    if body and len(sample.body_faces):
        vertices = np.stack([sample.body_vertices(frame).astype(np.float32) for frame in frames])
        arrays |= {"body_vertices": vertices, "body_faces": sample.body_faces}
    return arrays


def frame_arrays(
    sample: Sample, frame: int, *, body: bool = False, positions: np.ndarray | None = None
) -> Arrays:
    """One frame of a sample.

    positions   instead of those in `sample`, of which then everything else is taken
    """
    arrays = _facts(sample) | {
        "frame": frame,
        "positions": sample.frame_positions(frame) if positions is None else positions,
        **_garment(sample.frame_garment(frame)),
    }
    if sample.body is not None:
        arrays |= {
            "beta": sample.body.beta,
            "pose": sample.body.poses[frame],
            "translation": sample.body.translations[frame],
        }
    if body and len(sample.body_faces):
        vertices = sample.body_vertices(frame).astype(np.float32)
        arrays |= {"body_vertices": vertices, "body_faces": sample.body_faces}
    return arrays


def _facts(sample: Sample) -> Arrays:
    return {
        "sample": sample.id,
        "split": sample.labels.get("split", ""),
        "kind": sample.kind,
        **{label: sample.labels.get(label, "") for label in LABELS},
        "fabric": sample.fabric,
        "fps": float(sample.fps or 0.0),
    }


def _garment(mesh: GarmentMesh) -> Arrays:
    return {name: getattr(mesh, name) for name in GARMENT_ARRAYS}
