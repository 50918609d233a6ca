"""How much of the cloth is inside the body, by exact signed distance and by the field's other definitions."""

from __future__ import annotations

from dataclasses import dataclass

import igl
import numpy as np

from muslin.garments.errors import InputError

HOOD_MARGIN = 1e-3  # metres


@dataclass(frozen=True)
class Penetration:
    """Of all cloth vertices in all frames seen.

    ratio        share of vertices inside the body, 0 to 1
    depth_mean   mean depth of the vertices inside, metres; 0 if none is inside
    depth_max    largest depth, metres; 0 if none is inside
    """

    ratio: float
    depth_mean: float
    depth_max: float


def is_closed(faces: np.ndarray) -> bool:
    """Whether every edge has exactly two triangles, in opposite directions: then inside is well defined."""
    directed = np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]]).astype(np.int64)
    n = int(directed.max(initial=0)) + 1
    forward = np.sort(directed[:, 0] * n + directed[:, 1])
    backward = np.sort(directed[:, 1] * n + directed[:, 0])
    return len(faces) > 0 and bool((np.diff(forward) > 0).all()) and np.array_equal(forward, backward)


def signed_distances(points: np.ndarray, vertices: np.ndarray, faces: np.ndarray) -> np.ndarray:
    """Distance of each point to a closed surface, negative inside.

    s(p) = +-min_{x in surface} |p - x|, minus where the winding number exceeds 1/2. A body that overlaps
    itself (armpit, crotch) has winding number 2 there, so such a point counts as inside and its depth is the
    distance to the nearest sheet, also to one that lies inside the body.

    points (N, 3), vertices (M, 3), metres; faces (F, 3), counter-clockwise from outside; returns (N,), m.
    Raises InputError if the surface has a boundary or a non-manifold edge.

    Source: the winding number of triangle soups of Barill et al. 2018, through libigl; the distance is exact.
    """
    if not is_closed(faces):
        raise InputError(
            "signed distance: the surface is not closed and oriented, so it has no inside; "
            "fill its holes, or leave the penetration out"
        )
    p = np.ascontiguousarray(points, dtype=np.float64)
    v = np.ascontiguousarray(vertices, dtype=np.float64)
    f = np.ascontiguousarray(faces, dtype=np.int64)
    # igl.signed_distance scales the distance by 1 - 2 w with an approximate w: wrong by some 0.1%, so
    # only the sign is taken from the winding number here.
    squared, _, _ = igl.point_mesh_squared_distance(p, v, f)
    inside = igl.fast_winding_number(v, f, p) > 0.5
    return np.where(inside, -1.0, 1.0) * np.sqrt(np.maximum(squared, 0.0))


def penetration(distances: np.ndarray) -> Penetration:
    """Ratio and depths from signed distances of any shape, metres, negative inside."""
    if distances.size == 0:
        raise InputError("penetration of no vertices: give at least one vertex and one frame")
    depth = np.maximum(-distances, 0.0)
    inside = distances < 0.0
    mean = float(depth[inside].mean()) if inside.any() else 0.0
    return Penetration(ratio=float(inside.mean()), depth_mean=mean, depth_max=float(depth.max()))


def distances_by_vertex_normal(points: np.ndarray, vertices: np.ndarray, faces: np.ndarray) -> np.ndarray:
    """(p - v) . n with the nearest body vertex v and its normal n; (N,), metres, negative counts as inside.

    What PBNS and NCS penalise. Not a distance: it is wrong by up to an edge length where the body is curved.
    """
    _, nearest, _ = igl.point_mesh_squared_distance(
        np.ascontiguousarray(points, dtype=np.float64),
        np.ascontiguousarray(vertices, dtype=np.float64),
        np.arange(len(vertices), dtype=np.int64)[:, None],
    )
    normals = vertex_normals(vertices, faces)
    return np.einsum("ij,ij->i", points - vertices[nearest], normals[nearest])


def distances_by_face_centre(points: np.ndarray, vertices: np.ndarray, faces: np.ndarray) -> np.ndarray:
    """(p - c) . n with the nearest face centre c and its normal n, less 1 mm; (N,), metres.

    What HOOD counts: a vertex less than 1 mm outside already counts as inside.
    """
    corners = vertices[faces]
    centres = corners.mean(axis=1)
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-300)
    _, nearest, _ = igl.point_mesh_squared_distance(
        np.ascontiguousarray(points, dtype=np.float64),
        np.ascontiguousarray(centres, dtype=np.float64),
        np.arange(len(centres), dtype=np.int64)[:, None],
    )
    return np.einsum("ij,ij->i", points - centres[nearest], normals[nearest]) - HOOD_MARGIN


def vertex_normals(vertices: np.ndarray, faces: np.ndarray) -> np.ndarray:
    """Unit normals, averaged over the triangles around a vertex by area; (V, 3)."""
    corners = vertices[faces]
    face_normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normals = np.zeros_like(vertices, dtype=np.float64)
    for k in range(3):
        np.add.at(normals, faces[:, k], face_normals)
    return normals / np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-300)
