"""What can be remeshed: one frame of a sample with its body, or a garment in an OBJ file."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from muslin.eval.read.subject import open_subject
from muslin.garments.errors import InputError
from muslin.garments.mesh import GarmentMesh
from muslin.garments.obj import read_garment
from muslin.sim.body.skinning import bind
from muslin.sim.dataset.intersections import find_crossings
from muslin.sim.dataset.sample import Sample, body_model


@dataclass(frozen=True, eq=False)
class RemeshSource:
    """A garment and its drape.

    positions                  (V, 3) metres; None for panels alone, which have no drape
    body_vertices, body_faces  (N, 3), (M, 3): what it must not cross, faces left out of contact left out
    skinning                   (V, 24) weights of the body's joints at the nearest points of the body; or None
    """

    mesh: GarmentMesh
    positions: NDArray[np.float64] | None
    body_vertices: NDArray[np.float64]
    body_faces: NDArray[np.int32]
    skinning: NDArray[np.float64] | None = None

    @cached_property
    def crossings(self) -> int:
        """How often the drape crosses itself or the body."""
        if self.positions is None:
            return 0
        return len(find_crossings(self.positions, self.mesh.faces, self.body_vertices, self.body_faces))


def remesh_source(path: Path, sample_id: str | None = None, frame: int = 0) -> RemeshSource:
    """The garment at `path`: an OBJ file with uv, one sample's folder, or a dataset with `sample_id`.

    The sample may be left out where the dataset has one alone. Raises InputError for anything else, and for
    a frame that is not there.
    """
    if path.is_file() and path.suffix.lower() == ".obj":
        mesh, positions = read_garment(path)
        return RemeshSource(mesh, positions, np.zeros((0, 3)), np.zeros((0, 3), dtype=np.int32))
    subject = open_subject(path)
    if sample_id is None and len(subject.ids) > 1:
        raise InputError(
            f"{path}: has {len(subject.ids)} samples; name one with --sample, such as {subject.ids[0]}"
        )
    sample = subject.load(subject.ids[0] if sample_id is None else sample_id).sample
    if sample is None:
        raise InputError(f"{path}: has no panels; give a sample, or a garment with uv as .obj")
    return _of_sample(sample, frame)


def _of_sample(sample: Sample, frame: int) -> RemeshSource:
    if frame >= sample.num_frames:
        raise InputError(f"--frame {frame}: sample {sample.id} has frames 0 to {sample.num_frames - 1}")
    positions = sample.frame_positions(frame).astype(np.float64)
    skinning = None
    if sample.body is not None:
        track = sample.body
        pose = track.poses[frame], track.translations[frame]
        skinning = bind(positions, body_model(track), track.beta, *pose).weights
    faces = np.delete(sample.body_faces, sample.masked(frame), axis=0)
    return RemeshSource(sample.frame_garment(frame), positions, sample.body_vertices(frame), faces, skinning)
