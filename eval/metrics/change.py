"""Change of edge lengths and areas, against the rest shape or against the truth."""

from __future__ import annotations

import numpy as np

from muslin.eval.metrics.checks import check_faces, checked_corners, checked_points, corner_areas
from muslin.garments.errors import InputError


def edge_length_changes(positions: np.ndarray, faces: np.ndarray, reference: np.ndarray) -> np.ndarray:
    """l / l_0 - 1 of the three sides of each face; (..., F, 3), no unit: 0.05 is 5% longer.

    Side k is opposite corner k. An edge inside the cloth is a side of two faces and comes twice; one on a
    seam has a reference length on each panel. For statistics over the surface, weigh each side with the area
    of its face: `side_weights`.

    positions   (..., V, 3), metres; faces (F, 3)
    reference   corners (F, 3, 2) of the faces in panel space, or (V, 3) positions such as the truth's, metres

    Raises InputError for arrays that do not match, are not finite, or a reference without lengths.
    """
    x, rest = _checked(positions, faces, reference, "edge lengths")
    corners = x[..., faces, :]
    now, before = (
        np.linalg.norm(np.roll(c, -2, axis=-2) - np.roll(c, -1, axis=-2), axis=-1) for c in (corners, rest)
    )
    return now / before - 1.0


def area_changes(positions: np.ndarray, faces: np.ndarray, reference: np.ndarray) -> np.ndarray:
    """A / A_0 - 1 of each face; (..., F), no unit: -1 is collapsed.

    positions, faces, reference as in `edge_length_changes`, and the same errors.
    """
    x, rest = _checked(positions, faces, reference, "areas")
    a, b, c = (x[..., faces[:, k], :] for k in range(3))
    return 0.5 * np.linalg.norm(np.cross(b - a, c - a), axis=-1) / corner_areas(rest) - 1.0


def side_weights(areas: np.ndarray) -> np.ndarray:
    """(F, 3): of each side of each face a third of the face's area (F,)."""
    return np.repeat(areas[:, None] / 3.0, 3, axis=1)


def _checked(
    positions: np.ndarray, faces: np.ndarray, reference: np.ndarray, what: str
) -> tuple[np.ndarray, np.ndarray]:
    """Positions, and the corners of the reference, both in float64."""
    x = checked_points(positions, what)
    check_faces(faces, x.shape[-2], what)
    if reference.ndim == 2:
        if reference.shape != x.shape[-2:]:
            raise InputError(
                f"{what}: positions of {x.shape[-2]} vertices and a reference of shape {reference.shape}; "
                "both need the same vertices"
            )
        return x, checked_corners(reference[faces], len(faces), what)
    return x, checked_corners(reference, len(faces), what)
