"""Predictions beside the truth, as a scene of the viewer that is coloured by their errors."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from muslin.eval.metrics.surface_sampling import point_to_surface
from muslin.eval.metrics.vertex import vertex_errors
from muslin.eval.read.track import Track
from muslin.eval.viewer.scene import MovingMesh, Scene
from muslin.sim.view.picture import AZIMUTH, facing

MM = 1000.0
TRUTH = "truth"


def side_by_side(name: str, truth: Track, predictions: Mapping[str, Track]) -> Scene:
    """A scene of the truth and of predictions by name; its name says what the colours are.

    Vertex errors if all predictions have the truth's vertices in every frame, else the distances of their
    vertices to the truth's surface; millimetres.
    """
    same = all(_corresponds(track, truth) for track in predictions.values())
    sides = {TRUTH: MovingMesh(truth.positions, truth.faces)}
    for key, track in predictions.items():
        # A file may hold vertices alone; it was scored with the truth's triangles.
        faces = track.faces or truth.faces
        sides[key] = MovingMesh(track.positions, faces, _errors(track, truth, same))
    measure = "vertex error" if same else "distance to the truth's surface"
    azimuth = AZIMUTH + (0.0 if truth.sample is None else facing(truth.sample, 0))
    return Scene(f"{name} ({measure})", sides, fps=truth.fps, body=_body(truth), azimuth=azimuth)


def _corresponds(prediction: Track, truth: Track) -> bool:
    """Whether both have the same vertices in every frame."""
    return all(
        len(prediction.positions[t]) == len(truth.positions[t])
        and (not prediction.faces or np.array_equal(prediction.faces[t], truth.faces[t]))
        for t in range(truth.num_frames)
    )


def _errors(prediction: Track, truth: Track, same: bool) -> list[np.ndarray]:
    """A frame: (V_t,) millimetres."""
    found = []
    for t in range(truth.num_frames):
        x, y = prediction.positions[t], truth.positions[t]
        found.append(MM * (vertex_errors(x, y) if same else point_to_surface(x, y, truth.faces[t])))
    return found


def _body(truth: Track) -> MovingMesh | None:
    if truth.body is None:
        return None
    return MovingMesh(truth.body.positions, [truth.body.faces] * truth.body.num_frames)
