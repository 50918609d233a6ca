"""Angles between the normals of two surfaces, face by face or at points of the surfaces."""

from __future__ import annotations

from dataclasses import dataclass

import igl
import numpy as np

from muslin.eval.metrics.checks import check_faces, checked_pair, checked_points
from muslin.eval.metrics.surface_sampling import sample_surface
from muslin.eval.metrics.vertex import Statistics, statistics
from muslin.garments.errors import InputError

NO_NORMAL = 0.5 * np.pi  # the mean angle to a direction that says nothing


@dataclass(frozen=True)
class NormalDistance:
    """Angles, radians, at points of the truth (`at_truth`) and at points of the prediction; their mean."""

    at_truth: Statistics
    at_prediction: Statistics

    @property
    def mean(self) -> float:
        return 0.5 * (self.at_truth.mean + self.at_prediction.mean)


def normal_errors(prediction: np.ndarray, truth: np.ndarray, faces: np.ndarray) -> np.ndarray:
    """Angle between the normals of corresponding faces: atan2(|n x m|, n . m); (F,), radians, 0 to pi.

    The order of a face's corners gives its normal its direction, so a triangle turned over has an error of
    pi. A triangle of the prediction without area has no normal and counts as pi / 2, the mean angle between
    unrelated directions. For statistics over the surface, weigh by `triangle_areas` of the truth.

    prediction, truth (V, 3), metres; faces (F, 3) of both. Raises InputError for arrays that do not match or
    are not finite, and for a truth with a triangle without area.
    """
    x, y = checked_pair(prediction, truth, "normal errors")
    check_faces(faces, len(y), "normal errors")
    n, m = _doubled_normals(x, faces), _doubled_normals(y, faces)
    _require_area(m, "the truth")
    return _angles(n, m)


def normal_distance(
    prediction: np.ndarray,
    prediction_faces: np.ndarray,
    truth: np.ndarray,
    truth_faces: np.ndarray,
    samples: int = 4_000,
    seed: int = 0,
) -> NormalDistance:
    """Angle between the normal at a point of one surface and that at the nearest point of the other.

        angle(a) = atan2(|n x m|, n . m),   n normal to a's face, m to that of the nearest point

    at `samples` points of each surface, evenly spread by area; radians, 0 to pi. Where the nearest point lies
    on an edge m is the mean of the normals on both sides, on a vertex that of all faces there by angle
    (Baerentzen, Aanaes 2005). The meshes need not share topology, but their orientation counts: of two equal
    surfaces with opposite faces every angle is pi. It is the angle whose |cosine| is the "normal consistency"
    of Mescheder et al. 2019, which hides the orientation.

    vertices (V, 3), metres; faces (F, 3). Raises InputError for meshes that are empty, not finite or without
    area.
    """
    x, y = (
        checked_points(side, f"normal distance: {name}")
        for side, name in ((prediction, "the prediction"), (truth, "the truth"))
    )
    check_faces(prediction_faces, len(x), "normal distance: the prediction")
    check_faces(truth_faces, len(y), "normal distance: the truth")
    return NormalDistance(
        at_truth=_one_sided(y, truth_faces, x, prediction_faces, samples, seed),
        at_prediction=_one_sided(x, prediction_faces, y, truth_faces, samples, seed),
    )


def _one_sided(
    points_of: np.ndarray, faces_of: np.ndarray, to: np.ndarray, faces_to: np.ndarray, samples: int, seed: int
) -> Statistics:
    at = sample_surface(points_of, faces_of, samples, seed)
    return statistics(_angles(_normals_near(at, to, faces_to), _normals_near(at, points_of, faces_of)))


def _normals_near(points: np.ndarray, vertices: np.ndarray, faces: np.ndarray) -> np.ndarray:
    """(N, 3) pseudonormals, of any length, at the nearest points of the faces that have an area."""
    kept = (_doubled_normals(vertices, faces) != 0.0).any(axis=1)
    if not kept.any():
        raise InputError("normal distance: no triangle has an area; give a mesh that is a surface")
    found = igl.signed_distance(
        points,
        np.ascontiguousarray(vertices),
        np.ascontiguousarray(faces[kept], dtype=np.int64),
        igl.SIGNED_DISTANCE_TYPE_PSEUDONORMAL,
    )
    return found[3]


def _doubled_normals(vertices: np.ndarray, faces: np.ndarray) -> np.ndarray:
    """(b - a) x (c - a): normals as long as twice the areas; (F, 3), m^2."""
    a, b, c = (vertices[faces[:, k]] for k in range(3))
    return np.cross(b - a, c - a)


def _angles(n: np.ndarray, m: np.ndarray) -> np.ndarray:
    """Angle between vectors of any length (N, 3); NO_NORMAL where n has none."""
    angle = np.arctan2(np.linalg.norm(np.cross(n, m), axis=-1), np.einsum("ij,ij->i", n, m))
    return np.where((n == 0.0).all(axis=-1), NO_NORMAL, angle)


def _require_area(normals: np.ndarray, whose: str) -> None:
    bad = np.flatnonzero((normals == 0.0).all(axis=1))
    if len(bad):
        raise InputError(
            f"normal errors: face {bad[0]} of {whose} has no area ({len(bad)} in all); remove such faces"
        )
