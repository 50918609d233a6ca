"""What every metric asks of its arrays: points, faces and rates that can be measured."""

from __future__ import annotations

import numpy as np

from muslin.garments.errors import InputError


def checked_points(points: np.ndarray, what: str) -> np.ndarray:
    """The points (..., N, 3) in float64. Raises InputError if there is none, or one is not finite; `what`
    begins the message."""
    if points.ndim < 2 or points.shape[-1] != 3 or points.size == 0:
        raise InputError(f"{what}: points of shape {points.shape} are not allowed; give (..., N >= 1, 3)")
    found = np.asarray(points, dtype=np.float64)
    if not np.isfinite(found).all():
        bad = int((~np.isfinite(found).all(axis=-1)).sum())
        raise InputError(f"{what}: NaN or infinity in {bad} points; every coordinate must be finite")
    return found


def checked_pair(prediction: np.ndarray, truth: np.ndarray, what: str) -> tuple[np.ndarray, np.ndarray]:
    """Both as `checked_points`. Raises InputError unless they have one shape, vertex for vertex."""
    if prediction.shape != truth.shape:
        raise InputError(
            f"{what}: the prediction has shape {prediction.shape} and the truth {truth.shape}; both need the "
            "same frames and vertices"
        )
    return checked_points(prediction, f"{what} of the prediction"), checked_points(
        truth, f"{what} of the truth"
    )


def check_faces(faces: np.ndarray, count: int, what: str) -> None:
    """Raise InputError unless faces (F, 3) name vertices 0 to count - 1, and there is one."""
    if faces.ndim != 2 or faces.shape[1] != 3 or len(faces) == 0:
        raise InputError(f"{what}: faces of shape {faces.shape} are not allowed; give (F >= 1, 3)")
    if faces.min() < 0 or faces.max() >= count:
        raise InputError(
            f"{what}: faces name vertices {faces.min()} to {faces.max()}; allowed: 0 to {count - 1}"
        )


def check_rate(fps: float, what: str) -> None:
    """Raise InputError unless fps, frames per second, is a positive number."""
    if not (np.isfinite(fps) and fps > 0):
        raise InputError(f"{what}: fps = {fps} is not allowed; it must be a positive number")


def checked_corners(corners: np.ndarray, num_faces: int, what: str) -> np.ndarray:
    """Corners (F, 3, 2) or (F, 3, 3) of triangles in float64. Raises InputError unless there is one for each
    face, finite, of positive area."""
    found = np.asarray(corners, dtype=np.float64)
    if found.ndim != 3 or found.shape[1] != 3 or found.shape[2] not in (2, 3) or len(found) != num_faces:
        raise InputError(
            f"{what}: corners of shape {corners.shape} are not allowed; for {num_faces} faces give "
            f"({num_faces}, 3, 2) in panel space or ({num_faces}, 3, 3)"
        )
    if not np.isfinite(found).all():
        raise InputError(f"{what}: NaN or infinity in the corners; every coordinate must be finite")
    bad = np.flatnonzero(corner_areas(found) <= 0.0)
    if len(bad):
        raise InputError(
            f"{what}: {len(bad)} triangles of the rest shape have no area, first {bad[0]}; remove them"
        )
    return found


def corner_areas(corners: np.ndarray) -> np.ndarray:
    """|(b - a) x (c - a)| / 2 of triangles of corners (F, 3, 2 or 3); (F,), m^2."""
    u, v = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    if corners.shape[2] == 2:
        return 0.5 * np.abs(u[:, 0] * v[:, 1] - u[:, 1] * v[:, 0])
    return 0.5 * np.linalg.norm(np.cross(u, v), axis=1)
