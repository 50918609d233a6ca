"""Penetration as others define it, by name: for comparison with their papers, and with one another."""

from __future__ import annotations

from dataclasses import asdict, dataclass

import igl
import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from muslin.eval.metrics.contact_input import check_triangles
from muslin.eval.metrics.penetration import is_closed, pseudonormal_distances
from muslin.eval.metrics.triangle_pairs import (
    TrianglePairs,
    intersecting_triangles,
    may_pierce,
    self_intersecting_triangles,
)
from muslin.eval.metrics.vertex import triangle_areas
from muslin.eval.metrics.winding import cloth_winding_numbers
from muslin.garments.errors import InputError

HOOD_MARGIN = 1e-3  # metres
SAMPLES = 50_000


@dataclass(frozen=True)
class PenetrationDefinitions:
    """One frame by every definition; shares from 0 to 1. None of them can stand in for another.

    signed_distance   share of vertices inside: exact distance, winding number (`distances_to_body`; its
                      fallback where the body is not closed)
    nearest_vertex    share of vertices behind the nearest body vertex along its normal: PBNS (Bertiche,
                      Madadi and Escalera 2021), NCS (2022)
    face_centre       share of vertices behind the nearest face centre along its normal, or less than 1 mm in
                      front of it: HOOD (Grigorev et al. 2023)
    sample_angle      share of random samples of the cloth that see the nearest random sample of the body at
                      more than 90 degrees from its normal: D-Garment (Dumoulin et al. 2025), 50,000 samples
                      of each
    body_edges        number of cloth edges that meet the body: GarmentCodeData (Korosteleva et al. 2024),
                      which keeps a drape with up to 35 of them
    self_edges        number of cloth edges that meet a triangle of the cloth without a common vertex: the
                      same, up to 300
    """

    signed_distance: float
    nearest_vertex: float
    face_centre: float
    sample_angle: float
    body_edges: int
    self_edges: int

    def to_dict(self) -> dict[str, float]:
        return asdict(self)


def penetration_definitions(
    cloth: np.ndarray,
    faces: np.ndarray,
    body: np.ndarray,
    body_faces: np.ndarray,
    samples: int = SAMPLES,
    seed: int = 0,
) -> PenetrationDefinitions:
    """Every definition for a cloth (V, 3), faces (F, 3), and a body (M, 3), body_faces (N, 3); metres.

    `samples` and `seed` are those of `sample_angle`, which is random as in its source: its standard deviation
    from seed to seed is at most 0.5 / sqrt(samples).
    """
    cloth, faces = check_triangles("cloth", cloth, faces)
    body, body_faces = check_triangles("body", body, body_faces)
    if samples < 1:
        raise InputError(f"samples = {samples}: must be 1 or more")
    pairs = intersecting_triangles(cloth, faces, body, body_faces)
    own = self_intersecting_triangles(cloth, faces)
    swapped = TrianglePairs(own.faces[:, ::-1], own.coplanar)
    return PenetrationDefinitions(
        signed_distance=_share_inside(cloth, faces, body, body_faces, pairs),
        nearest_vertex=float((distances_by_vertex_normal(cloth, body, body_faces) < 0.0).mean()),
        face_centre=float((distances_by_face_centre(cloth, body, body_faces) < 0.0).mean()),
        sample_angle=share_by_sample_angle(cloth, faces, body, body_faces, samples, seed),
        body_edges=len(_meeting_edges(pairs, cloth, faces, body, body_faces)),
        self_edges=len(
            np.union1d(
                _meeting_edges(own, cloth, faces, cloth, faces),
                _meeting_edges(swapped, cloth, faces, cloth, faces),
            )
        ),
    )


def distances_by_vertex_normal(points: np.ndarray, vertices: np.ndarray, faces: np.ndarray) -> np.ndarray:
    """(p - v) . n with the nearest body vertex v and its normal n; (N,), metres, negative counts as inside.

    What PBNS and NCS penalise. Not a distance: it is wrong by up to an edge length where the body is curved.
    """
    _, nearest = cKDTree(vertices).query(points)
    normals = igl.per_vertex_normals(
        np.ascontiguousarray(vertices, dtype=np.float64),
        np.ascontiguousarray(faces, dtype=np.int64),
        igl.PER_VERTEX_NORMALS_WEIGHTING_TYPE_AREA,
    )
    return np.einsum("ij,ij->i", points - vertices[nearest], normals[nearest])


def distances_by_face_centre(points: np.ndarray, vertices: np.ndarray, faces: np.ndarray) -> np.ndarray:
    """(p - c) . n with the nearest face centre c and its normal n, less 1 mm; (N,), metres.

    What HOOD counts: a vertex less than 1 mm outside already counts as inside.
    """
    centres = vertices[faces].mean(axis=1)
    _, nearest = cKDTree(centres).query(points)
    normals = _face_normals(vertices, faces[nearest])
    return np.einsum("ij,ij->i", points - centres[nearest], normals) - HOOD_MARGIN


def share_by_sample_angle(
    cloth: np.ndarray,
    faces: np.ndarray,
    body: np.ndarray,
    body_faces: np.ndarray,
    samples: int = SAMPLES,
    seed: int = 0,
) -> float:
    """Share of random cloth samples p with (p - q) . n < 0, q the nearest random body sample, n its face's
    normal.

    What D-Garment reports. With s body samples a square metre, q lies some 1 / sqrt(s) from the nearest point
    of the body, so a cloth nearer to the skin than that over a curve of it counts as inside here and there.
    """
    rng = np.random.default_rng(seed)
    points, _ = _random_samples(cloth, faces, samples, rng)
    targets, face = _random_samples(body, body_faces, samples, rng)
    _, nearest = cKDTree(targets).query(points)
    normals = _face_normals(body, body_faces[face[nearest]])
    return float((np.einsum("ij,ij->i", points - targets[nearest], normals) < 0.0).mean())


def _share_inside(
    cloth: np.ndarray, faces: np.ndarray, body: np.ndarray, body_faces: np.ndarray, pairs: TrianglePairs
) -> float:
    """Share of vertices with a negative distance to the body, by the sign alone."""
    if is_closed(body_faces):
        return float((cloth_winding_numbers(cloth, faces, body, body_faces, pairs) > 0).mean())
    return float((pseudonormal_distances(cloth, body, body_faces) < 0.0).mean())


def _random_samples(
    vertices: np.ndarray, faces: np.ndarray, count: int, rng: np.random.Generator
) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """Independent points (count, 3), uniform by area, and their faces (count,)."""
    areas = triangle_areas(vertices, faces)
    if not areas.sum() > 0.0:
        raise InputError(f"cannot place {count} samples on a surface of area {areas.sum()} m^2")
    face = rng.choice(len(faces), size=count, p=areas / areas.sum())
    u, v = rng.random((2, count))
    root = np.sqrt(u)
    weights = np.stack([1.0 - root, root * (1.0 - v), root * v], axis=1)
    return np.einsum("ik,ikx->ix", weights, vertices[faces[face]]), face


def _face_normals(vertices: np.ndarray, faces: np.ndarray) -> NDArray[np.float64]:
    a, b, c = (vertices[faces[:, k]] for k in range(3))
    normals = np.cross(b - a, c - a)
    return normals / np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), np.finfo(float).tiny)


def _meeting_edges(
    pairs: TrianglePairs, cloth: np.ndarray, faces: np.ndarray, others: np.ndarray, other_faces: np.ndarray
) -> NDArray[np.int64]:
    """A number for each edge of the cloth that meets the other triangle of a pair, as edge counts take it: an
    edge that no rounding can part from the triangle counts."""
    i, j = pairs.faces.T
    pair, edge = np.nonzero(may_pierce(cloth[faces[i]], others[other_faces[j]]))
    ends = np.stack([faces[i[pair], edge], faces[i[pair], (edge + 1) % 3]], axis=1)
    return np.unique(np.sort(ends, axis=1) @ np.array([len(cloth), 1]))
