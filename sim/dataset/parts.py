"""Named moving surfaces: what the exporters write, from a sample or from a plain mesh file."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import trimesh

from muslin.garments.errors import InputError
from muslin.sim.dataset.remeshed import RemeshedSequence
from muslin.sim.dataset.sample import Sample


@dataclass(frozen=True, eq=False)
class Part:
    """One surface of constant topology.

    positions   (T, V, 3) float32, metres
    faces       (F, 3) int32
    uv          (P, 2) float64 in [0, 1]^2 with uv_faces (F, 3) int32, corner for corner as `faces`; or None
    """

    name: str
    positions: np.ndarray
    faces: np.ndarray
    uv: np.ndarray | None = None
    uv_faces: np.ndarray | None = None

    @property
    def num_frames(self) -> int:
        return len(self.positions)

    def at(self, frame: int) -> Part:
        """One frame; the last of them for any after it, so that what stands still is there in every frame."""
        frame = min(frame, self.num_frames - 1)
        return replace(self, positions=self.positions[frame : frame + 1])

    @property
    def uv_to_vertex(self) -> np.ndarray:
        """(P,) vertex of each uv point."""
        if self.uv is None or self.uv_faces is None:
            return np.arange(self.positions.shape[1])
        vertex = np.zeros(len(self.uv), dtype=np.int64)
        vertex[self.uv_faces] = self.faces
        return vertex


@dataclass(frozen=True, eq=False)
class RemeshedPart:
    """One surface whose topology changes over time.

    topologies       a topology: the part at one of the frames that have it
    frame_topology   (T,) place in `topologies` of each frame
    frames           (V_t, 3) float32 positions of each frame, metres
    """

    name: str
    topologies: tuple[Part, ...]
    frame_topology: np.ndarray
    frames: tuple[np.ndarray, ...]

    @property
    def num_frames(self) -> int:
        return len(self.frames)

    def at(self, frame: int) -> Part:
        """One frame."""
        return replace(self.topologies[self.frame_topology[frame]], positions=self.frames[frame][None])


MovingPart = Part | RemeshedPart


def sample_parts(sample: Sample, body: bool = True) -> list[MovingPart]:
    """The cloth of a sample, and the body or obstacle if it has one. A body that stands still repeats each
    frame."""
    parts: list[MovingPart] = [_cloth(sample)]
    if body and len(sample.body_faces):
        moving = np.stack([sample.body_vertices(frame) for frame in range(sample.num_frames)])
        parts.append(Part("body", moving.astype(np.float32), sample.body_faces))
    return parts


def _cloth(sample: Sample) -> MovingPart:
    if not isinstance(sample, RemeshedSequence):
        garment = sample.garment
        return Part("cloth", sample.positions, garment.faces, garment.uv, garment.panel_faces)
    first = [int(np.argmax(sample.frame_topology == k)) for k in range(len(sample.topologies))]
    topologies = tuple(
        Part("cloth", sample.frames[frame][None], mesh.faces, mesh.uv, mesh.panel_faces)
        for frame, mesh in zip(first, sample.topologies, strict=True)
    )
    return RemeshedPart("cloth", topologies, sample.frame_topology, sample.frames)


def read_mesh(path: str | Path) -> Part:
    """A triangle mesh from an OBJ, PLY, GLB, STL or OFF file, its vertices in the order of the file.

    Raises InputError if the file is missing, not a mesh, empty, or holds NaN or infinity.
    """
    file = Path(path)
    if not file.is_file():
        raise InputError(f"{file}: no such file; give a mesh file (.obj, .ply, .glb, .stl, .off)")
    try:
        # force keeps one mesh of a file with groups; process=False keeps the order of the vertices.
        mesh = trimesh.load(file, force="mesh", process=False, maintain_order=True)
    except (ValueError, KeyError, TypeError, IndexError, NotImplementedError, OSError) as error:
        raise InputError(
            f"{file}: not readable as a mesh ({error}); give .obj, .ply, .glb, .stl or .off"
        ) from error
    if not isinstance(mesh, trimesh.Trimesh) or not len(mesh.faces):
        raise InputError(f"{file}: holds no triangle; give a triangle mesh")
    if not np.isfinite(mesh.vertices).all():
        raise InputError(f"{file}: NaN or infinity in its vertices; every coordinate must be finite")
    return Part(file.stem, mesh.vertices[None].astype(np.float32), mesh.faces.astype(np.int32))
