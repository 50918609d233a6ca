"""A sheet that rises over a ball, as arrays, and as files of other people's methods."""

from __future__ import annotations

import struct
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest
import trimesh

from muslin.eval.read.track import Track


@dataclass(frozen=True)
class Scene:
    """positions (T, V, 3), faces (F, 3) of the sheet, which rises 1 cm a frame; body, body_faces: a ball"""

    positions: np.ndarray
    faces: np.ndarray
    body: np.ndarray
    body_faces: np.ndarray

    @property
    def moving_body(self) -> np.ndarray:
        return np.repeat(self.body[None], len(self.positions), axis=0)


def make_scene(n: int = 6, frames: int = 4) -> Scene:
    x = np.linspace(-0.4, 0.4, n)
    X, Z = np.meshgrid(x, x, indexing="ij")
    level = np.stack([X.ravel(), np.full(n * n, 0.21) + 0.01 * X.ravel(), Z.ravel()], axis=1)
    i = (np.arange(n - 1)[:, None] * n + np.arange(n - 1)).ravel()
    faces = np.concatenate([np.c_[i, i + 1, i + n + 1], np.c_[i, i + n + 1, i + n]])
    positions = np.stack([level + np.array([0, 0.01 * t, 0]) for t in range(frames)]).astype(np.float32)
    ball = trimesh.creation.icosphere(1, 0.2)
    return Scene(positions, faces, np.array(ball.vertices, np.float32), np.array(ball.faces))


@pytest.fixture
def scene() -> Scene:
    return make_scene()


def cache(positions: np.ndarray, dtype: str = "<f4", **header: int | bytes) -> bytes:
    """A point cache; `header` replaces fields: magic, version, points, samples."""
    fields = {
        "magic": b"POINTCACHE2\0",
        "version": 1,
        "points": positions.shape[1],
        "samples": len(positions),
    }
    fields |= header
    head = struct.pack(
        "<12siiffi", fields["magic"], fields["version"], fields["points"], 0.0, 1.0, fields["samples"]
    )
    return head + positions.astype(dtype).tobytes()


def write_obj(path: Path, vertices: np.ndarray, faces: np.ndarray) -> Path:
    path.parent.mkdir(parents=True, exist_ok=True)
    lines = ["v {:.9g} {:.9g} {:.9g}".format(*v) for v in vertices.tolist()]
    lines += ["f {} {} {}".format(*f) for f in (faces + 1).tolist()]
    path.write_text("\n".join(lines) + "\n")
    return path


def assert_shows(track: Track, scene: Scene, tolerance: float = 0.0) -> None:
    """The track is the scene's sheet, frame by frame, in double precision."""
    assert track.num_frames == len(scene.positions)
    for t, x in enumerate(scene.positions):
        assert track.positions[t].dtype == np.float64
        np.testing.assert_allclose(track.positions[t], x, rtol=0, atol=tolerance)
        np.testing.assert_array_equal(track.faces[t], scene.faces)
    assert len({id(faces) for faces in track.faces}) == 1


def assert_lies_on(track: Track, scene: Scene) -> None:
    """The track's body is the scene's ball in every frame."""
    assert track.body is not None
    assert track.body.closed
    np.testing.assert_array_equal(track.body.faces, scene.body_faces)
    for t in range(track.num_frames):
        np.testing.assert_allclose(track.body.vertices(t), scene.body, rtol=0, atol=1e-6)
