"""Points that move with a body's skin, and the inverse: back to the T-pose."""

from __future__ import annotations

from dataclasses import dataclass

import igl
import numpy as np
from numpy.typing import ArrayLike, NDArray

from muslin.garments.errors import InputError
from muslin.sim.body.joints import NUM_JOINTS
from muslin.sim.body.model import BodyModel

Floats = NDArray[np.float64]

# Below this determinant a blended transform folds space and has no useful inverse.
SMALLEST_DETERMINANT = 1e-3


@dataclass(frozen=True, eq=False)
class Binding:
    """The body triangle nearest to each point; skin data is interpolated over it.

    face_indices: (P,) int32; barycentric: (P, 3) non-negative, rows sum to one; distances: (P,) metres
    """

    model: BodyModel
    face_indices: NDArray[np.int32]
    barycentric: Floats
    distances: Floats

    def interpolate(self, values: Floats) -> Floats:
        """Values per body vertex (V, ...) at the nearest points of the body, (P, ...)."""
        corners = values[self.model.faces[self.face_indices]]
        return np.einsum("pk,pk...->p...", self.barycentric, corners)

    @property
    def weights(self) -> Floats:
        """Skinning weights of the points, (P, 24), rows sum to one."""
        return self.interpolate(self.model.weights)


def bind(
    points: ArrayLike,
    model: BodyModel,
    beta: ArrayLike | None = None,
    theta: ArrayLike | None = None,
    translation: ArrayLike = 0.0,
) -> Binding:
    """Binds points to the nearest points of the body.

    Args:
        points: (P, 3), metres, around the body of this beta, theta (None: T-pose) and translation.

    Raises:
        InputError: points of another shape, or not finite.
    """
    points = _checked_points(points)
    body = model.vertices(beta, theta, translation)
    squared, face_indices, nearest = igl.point_mesh_squared_distance(points, body, model.faces)
    corners = body[model.faces[face_indices]]
    coordinates = igl.barycentric_coordinates(
        nearest, *(np.ascontiguousarray(corners[:, k]) for k in range(3))
    )
    # A nearest point on an edge may round to a hair outside its triangle.
    coordinates = np.clip(coordinates, 0.0, None)
    coordinates /= coordinates.sum(axis=1, keepdims=True)
    return Binding(model, face_indices.astype(np.int32), coordinates, np.sqrt(squared))


def pose(
    points: ArrayLike,
    binding: Binding,
    beta: ArrayLike | None,
    theta: ArrayLike,
    translation: ArrayLike = 0.0,
) -> Floats:
    """Points of the T-pose carried into a pose, as the skin they are bound to is.

        y = M (x + d) + t,   [M t] = sum_j w_j G_j(beta, theta),   d = offset of the pose blend shapes

    with w and d interpolated at the nearest point of the body.

    Args:
        points: (P, 3), unposed. theta: (24, 3), translation: (3,).

    Returns:
        (P, 3)
    """
    linear, shift, offsets = _skin_motion(binding, beta, theta, translation)
    return np.einsum("pij,pj->pi", linear, _checked_points(points) + offsets) + shift


def unpose(
    points: ArrayLike,
    binding: Binding,
    beta: ArrayLike | None,
    theta: ArrayLike,
    translation: ArrayLike = 0.0,
) -> Floats:
    """The exact inverse of `pose`: x = M^-1 (y - t) - d, (P, 3).

    Raises:
        InputError: a point whose blended transform is singular (joints turned against each other by nearly
            half a turn).
    """
    linear, shift, offsets = _skin_motion(binding, beta, theta, translation)
    determinants = np.linalg.det(linear)
    worst = int(np.argmin(determinants)) if len(determinants) else 0
    if len(determinants) and determinants[worst] < SMALLEST_DETERMINANT:
        raise InputError(
            f"point {worst} cannot be unposed: its blended transform has determinant "
            f"{determinants[worst]:.2g}, allowed is at least {SMALLEST_DETERMINANT}; the pose folds the skin "
            "there"
        )
    return np.linalg.solve(linear, (_checked_points(points) - shift)[..., None])[..., 0] - offsets


def _skin_motion(
    binding: Binding, beta: ArrayLike | None, theta: ArrayLike, translation: ArrayLike
) -> tuple[Floats, Floats, Floats]:
    """Blended linear part (P, 3, 3), shift (P, 3) and pose blend shape offset (P, 3) of every point."""
    transforms = binding.model.transforms(beta, theta, translation)
    if transforms.shape != (NUM_JOINTS, 4, 4):
        raise InputError(
            f"transforms have shape {transforms.shape}; pose and unpose take one frame at a time"
        )
    blended = (binding.weights @ transforms.reshape(NUM_JOINTS, 16)).reshape(-1, 4, 4)
    offsets = binding.interpolate(binding.model.pose_offsets(theta))
    return blended[:, :3, :3], blended[:, :3, 3], offsets


def _checked_points(points: ArrayLike) -> Floats:
    values = np.ascontiguousarray(points, dtype=np.float64)
    if values.ndim != 2 or values.shape[1] != 3:
        raise InputError(f"points have shape {values.shape}; allowed is (P, 3), metres")
    if not np.isfinite(values).all():
        raise InputError(f"point {int(np.argmin(np.isfinite(values).all(axis=1)))} holds NaN or infinity")
    return values
