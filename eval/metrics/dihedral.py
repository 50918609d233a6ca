"""Signed dihedral angles of the edges of a mesh, and their errors: folds and wrinkles."""

from __future__ import annotations

import numpy as np

from muslin.eval.metrics.checks import check_faces, checked_corners, checked_points, corner_areas
from muslin.eval.metrics.vertex import triangle_areas
from muslin.garments.errors import InputError
from muslin.garments.half_edges import half_edges, opposite


def hinges(faces: np.ndarray) -> np.ndarray:
    """Interior edges as (x0, x1, x2, x3, f, g); (H, 6) int64.

    The edge runs from x0 to x1 in face f, whose third corner is x2, and back in face g, whose third is x3.
    Once for all frames of a topology. Raises InputError for faces that are no oriented manifold.
    """
    check_faces(faces, int(faces.max(initial=-1)) + 1, "dihedral angles")
    num_faces = len(faces)
    half = half_edges(faces).astype(np.int64)
    size = int(faces.max()) + 1
    keys = half @ np.array([size, 1])
    if len(np.unique(keys)) < len(keys):
        raise InputError(
            "dihedral angles: two faces run through one edge in one direction; give a manifold mesh whose "
            "faces are oriented alike"
        )
    twin = opposite(half[:, 0], half[:, 1], size)
    first = np.flatnonzero(twin > np.arange(len(half)))
    third = faces[:, [2, 0, 1]].T.ravel()
    pairs = first % num_faces, twin[first] % num_faces
    return np.stack([half[first, 0], half[first, 1], third[first], third[twin[first]], *pairs], axis=1)


def dihedral_angles(vertices: np.ndarray, edges: np.ndarray) -> np.ndarray:
    """Signed angle between the normals on both sides of interior edges; (..., H), radians, in (-pi, pi].

        theta = atan2( (n x m) . e / |e|,  n . m ),   e = x1 - x0,  n = e x (x2 - x0),  m = (x3 - x0) x e

    0 where the surface is flat, positive where it is convex seen from the side that the normals point to (a
    ridge; on a closed surface with normals outward, its own convexity), negative in a valley. The sign is
    that of the simulator's hinges. Rigid motions change nothing, mirroring without turning the faces changes
    every sign.

    vertices (..., V, 3), metres; edges (H, 6) of `hinges`.
    """
    x = checked_points(vertices, "dihedral angles")
    x0, x1, x2, x3 = (x[..., edges[:, k], :] for k in range(4))
    e = x1 - x0
    n, m = np.cross(e, x2 - x0), np.cross(x3 - x0, e)
    length = np.maximum(np.linalg.norm(e, axis=-1), 1e-30)
    return np.arctan2((np.cross(n, m) * e).sum(axis=-1) / length, (n * m).sum(axis=-1))


def dihedral_errors(prediction: np.ndarray, truth: np.ndarray, edges: np.ndarray) -> np.ndarray:
    """|theta_e - theta'_e| of corresponding interior edges, the shorter way round; (..., H), radians.

    Its root mean square with `edge_areas` as weights is the dihedral error of a surface:

        sqrt( sum_e A_e (theta_e - theta'_e)^2 / sum_e A_e )

    For given shapes the angles shrink with the length of the edges, so the figures of meshes of different
    resolution are not comparable. prediction, truth (..., V, 3), metres; edges (H, 6) of `hinges`. Raises
    InputError if the shapes differ, a value is not finite, or no interior edge is there.
    """
    if prediction.shape != truth.shape:
        raise InputError(
            f"dihedral errors: the prediction has shape {prediction.shape} and the truth {truth.shape}; "
            "they exist for equal topology only"
        )
    if len(edges) == 0:
        raise InputError("dihedral errors: the mesh has no interior edge; give one of two triangles or more")
    difference = dihedral_angles(prediction, edges) - dihedral_angles(truth, edges)
    return np.abs(np.remainder(difference + np.pi, 2.0 * np.pi) - np.pi)


def edge_areas(shape: np.ndarray, edges: np.ndarray, faces: np.ndarray) -> np.ndarray:
    """A_e = (A_f + A_g) / 3: a third of both triangles at an interior edge; (H,), m^2.

    shape   (V, 3), the truth or a rest shape, metres; or corners (F, 3, 2) of the faces in panel space
    """
    if shape.ndim == 3:
        areas = corner_areas(checked_corners(shape, len(faces), "edge areas"))
    else:
        areas = triangle_areas(checked_points(shape, "edge areas"), faces)
    return (areas[edges[:, 4]] + areas[edges[:, 5]]) / 3.0
