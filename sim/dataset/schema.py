"""The form of a dataset on disk.

    ROOT/muslin.json               header: schema version, config, versions, solver digest, splits
    ROOT/index.parquet             one row a sample; a cache of what the samples say, rebuilt when missing
    ROOT/samples/ID.zarr/          one zarr 3 group a sample
    ROOT/failed/ID.npz             last good state of a sample whose simulation could not go on
    ROOT/.partial/, ROOT/.lock     samples being written, and the lock of the process that writes

Attributes of a group: `meta` (what is not an array, certificate included), `sha256` of every array's bytes (C
order, little endian) and `meta_sha256` of the canonical JSON of `meta`. Arrays are compressed without loss.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

SCHEMA_VERSION = 1
FORMAT = "muslin dataset"

HEADER = "muslin.json"
INDEX = "index.parquet"
SAMPLES = "samples"
PARTIAL = ".partial"
FAILED = "failed"
LOCK = ".lock"
SUFFIX = ".zarr"

CHUNK_BYTES = 1 << 20
"""Frames are gathered in chunks of about this size, so that one frame can be read without the whole
sequence."""


@dataclass(frozen=True)
class ArraySpec:
    """dtype, names of the dimensions and meaning of one stored array."""

    dtype: str
    dimensions: tuple[str, ...]
    meaning: str

    @property
    def by_frame(self) -> bool:
        return self.dimensions[0] == "frame"


GARMENT_ARRAYS = {
    "faces": ArraySpec("int32", ("face", "corner"), "sewn connectivity, counter-clockwise seen from outside"),
    "panel_faces": ArraySpec("int32", ("face", "corner"), "the same triangles, indexing panel_vertices"),
    "panel_vertices": ArraySpec("float64", ("panel_vertex", "xy"), "panel space, metres"),
    "panel_to_vertex": ArraySpec("int32", ("panel_vertex",), "sewn vertex of each panel vertex"),
    "face_panel": ArraySpec("int32", ("face",), "panel of each triangle"),
    "uv": ArraySpec("float64", ("panel_vertex", "uv"), "canonical layout in [0, 1]^2"),
}

SAMPLE_ARRAYS = {
    "positions": ArraySpec("float32", ("frame", "vertex", "xyz"), "cloth, metres"),
    "beta": ArraySpec("float64", ("component",), "body shape, standard deviations"),
    "poses": ArraySpec("float64", ("frame", "joint", "axis_angle"), "body pose, radians"),
    "translations": ArraySpec("float64", ("frame", "xyz"), "body translation, metres"),
    "obstacle_vertices": ArraySpec("float32", ("frame", "obstacle_vertex", "xyz"), "collider, metres"),
    "obstacle_faces": ArraySpec("int32", ("obstacle_face", "corner"), "collider's triangles"),
    "masked_counts": ArraySpec("int32", ("frame",), "masked faces in each frame"),
    "masked_indices": ArraySpec("int32", ("masked",), "masked faces of all frames, one after the other"),
}

ARRAYS = GARMENT_ARRAYS | SAMPLE_ARRAYS


def chunk_frames(shape: tuple[int, ...], itemsize: int) -> int:
    """Frames in one chunk of an array whose first dimension counts frames."""
    frame_bytes = max(1, int(np.prod(shape[1:])) * itemsize)
    return int(np.clip(CHUNK_BYTES // frame_bytes, 1, max(1, shape[0])))
