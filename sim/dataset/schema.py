"""The form of a dataset on disk.

    ROOT/muslin.json               header: schema version, config, versions, solver digest, splits
    ROOT/index.parquet             one row a sample; a cache of what the samples say, rebuilt when missing
    ROOT/README.md                 card: what the dataset is, for people; written by `generate`
    ROOT/samples.png               picture of some samples from all over the dataset
    ROOT/progress.json             how far the last run was, for who looks from elsewhere
    ROOT/samples/ID.zarr.zip       one zarr 3 group a sample, in an archive without compression
    ROOT/failed/ID.json            why a sample was given up, and all that is needed to look into it
    ROOT/failed/ID.npz             last good state of a sample whose simulation could not go on
    ROOT/failed/ID.zarr.zip-N      a sample that was found damaged, set aside by `muslin repair`
    ROOT/.partial/, ROOT/.lock     files being written, and the lock of the process that writes

ROOT is a folder, or a place in an object store (no `.partial` there: objects appear whole).

Attributes of a group: `meta` (what is not an array, certificate included), `sha256` of every array's bytes (C
order, little endian) and `meta_sha256` of the canonical JSON of `meta`. Arrays are compressed without loss.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

SCHEMA_VERSION = 2
"""Of the folder and its header; 1 had a folder a sample."""
SAMPLE_VERSION = 1
"""Of a sample of fixed topology: its form did not change when remeshed sequences came."""
REMESHED_SAMPLE_VERSION = 2
"""Of a sequence whose topology changes; the newest."""
FORMAT = "muslin dataset"

HEADER = "muslin.json"
INDEX = "index.parquet"
CARD = "README.md"
PROGRESS = "progress.json"
PICTURE = "samples.png"
SAMPLES = "samples"
PARTIAL = ".partial"
FAILED = "failed"
LOCK = ".lock"
SUFFIX = ".zarr.zip"

CHUNK_BYTES = 1 << 18
"""Frames (or their rows) are gathered in chunks of about this size, so that one frame can be read without the
whole sequence."""


STACKED = "stacked_"
"""Begins the name of a dimension that counts the rows of all topologies, or frames, one after the other."""


@dataclass(frozen=True)
class ArraySpec:
    """dtype, names of the dimensions and meaning of one stored array."""

    dtype: str
    dimensions: tuple[str, ...]
    meaning: str

    @property
    def by_rows(self) -> bool:
        """Whether the first dimension may be long: then it is cut into chunks."""
        return self.dimensions[0] == "frame" or self.dimensions[0].startswith(STACKED)

    @property
    def is_coordinates(self) -> bool:
        """Whether it holds points: then x, y and z are stored apart."""
        return self.dtype == "float32" and self.dimensions[-1] == "xyz"


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

REMESHED_ARRAYS = {
    **{
        name: ArraySpec(
            spec.dtype,
            (STACKED + spec.dimensions[0], *spec.dimensions[1:]),
            f"{spec.meaning}; topology after topology, indices counted within each",
        )
        for name, spec in GARMENT_ARRAYS.items()
    },
    "positions": ArraySpec("float32", (STACKED + "vertex", "xyz"), "cloth, frame after frame, metres"),
    "frame_topology": ArraySpec("int32", ("frame",), "topology of each frame"),
    "topology_sizes": ArraySpec(
        "int32", ("topology", "size"), "numbers of vertices, faces and panel vertices of each topology"
    ),
}
"""Instead of, or beside, the arrays of the same names where the topology changes."""


def chunk_rows(shape: tuple[int, ...], itemsize: int) -> int:
    """Rows (frames, say) in one chunk of an array that is cut into chunks along its first dimension."""
    row_bytes = max(1, int(np.prod(shape[1:])) * itemsize)
    return int(np.clip(CHUNK_BYTES // row_bytes, 1, max(1, shape[0])))
