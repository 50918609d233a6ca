"""Shape and size of single triangles: angles, distortion, signed quality, spread of areas."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

EQUILATERAL = 0.25 * np.sqrt(3.0)  # area of an equilateral triangle over the square of its side
DEGENERATE = 1e-6  # |quality| up to which a triangle counts as degenerate


def angles(points: NDArray[np.float64], faces: NDArray[np.int32]) -> NDArray[np.float64]:
    """theta = atan2(|u x v|, u . v) at each corner, u and v the edges that leave it; (F, 3), radians.

    points (N, 2) or (N, 3); faces (F, 3). Exact to rounding for the smallest angles too, where the arc cosine
    of `corner_angles` has half the digits; 0 at a corner with an edge of no length, where that is NaN.
    """
    corners = _corners(points, faces)
    u = np.roll(corners, -1, axis=1) - corners
    v = np.roll(corners, 1, axis=1) - corners
    return np.arctan2(np.linalg.norm(np.cross(u, v), axis=2), (u * v).sum(axis=2))


def distortion(points: NDArray[np.float64], faces: NDArray[np.int32]) -> NDArray[np.float64]:
    """Normalised aspect of each triangle; (F,), 1 for an equilateral one, infinite for one without area.

        (sqrt(3) / 2) l / h,    l the longest edge, h = 2 |A| / l the smallest altitude, A the area

    It is the `aspect ratio` l / h of the finite element literature, scaled, and 1 / |`signed_quality`|.

    points (N, 2) or (N, 3); faces (F, 3).
    """
    corners = _corners(points, faces)
    longest = _longest_squared(corners)
    area = 0.5 * np.linalg.norm(
        np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1
    )
    result = np.full(len(faces), np.inf)
    np.divide(EQUILATERAL * longest, area, out=result, where=area > 0.0)
    return result


def signed_quality(points: NDArray[np.float64], faces: NDArray[np.int32]) -> NDArray[np.float64]:
    """(4 / sqrt(3)) A / l^2, A the signed area, l the longest edge; (F,), from -1 to 1, without a unit.

    1 for a counter-clockwise equilateral triangle, 0 for one without area (one point included), negative for
    an inverted one. points (N, 2); faces (F, 3).
    """
    corners = _corners(points, faces)
    longest = _longest_squared(corners)
    area = 0.5 * np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])[:, 2]
    result = np.zeros(len(faces))
    np.divide(area, EQUILATERAL * longest, out=result, where=longest > 0.0)
    return result


def degenerate_and_inverted(points: NDArray[np.float64], faces: NDArray[np.int32]) -> tuple[int, int]:
    """How many triangles over points (N, 2) have |`signed_quality`| <= DEGENERATE, and how many one below."""
    quality = signed_quality(points, faces)
    return int((np.abs(quality) <= DEGENERATE).sum()), int((quality < -DEGENERATE).sum())


def coefficient_of_variation(values: NDArray[np.float64]) -> float:
    """Standard deviation of a population over its mean: sqrt(mean (a - mean a)^2) / mean a; no unit."""
    return float(values.std() / values.mean())


def _corners(points: NDArray[np.float64], faces: NDArray[np.int32]) -> NDArray[np.float64]:
    """(F, 3 corners, 3 coordinates); z = 0 in the plane."""
    if points.shape[1] == 2:
        points = np.column_stack([points, np.zeros(len(points))])
    return points[faces]


def _longest_squared(corners: NDArray[np.float64]) -> NDArray[np.float64]:
    return ((np.roll(corners, -1, axis=1) - corners) ** 2).sum(axis=2).max(axis=1)
