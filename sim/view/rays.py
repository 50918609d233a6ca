"""Casting many rays at triangles, on the processor."""

from __future__ import annotations

from dataclasses import dataclass

import igl.embree
import numpy as np

BATCH = 400_000


@dataclass(frozen=True, eq=False)
class Hits:
    """First hits of N rays: face (N,) int, -1 for none; barycentric weights (N, 3) of the face's corners."""

    face: np.ndarray
    weights: np.ndarray


def cast(origins: np.ndarray, directions: np.ndarray, vertices: np.ndarray, faces: np.ndarray) -> Hits:
    """First hit of each ray. Nothing may lie behind an origin: the caster looks both ways.

    origins, directions (N, 3); vertices (V, 3); faces (F, 3). Single precision (Embree, in libigl's wheel).
    """
    v = np.ascontiguousarray(vertices, dtype=np.float64)
    f = np.ascontiguousarray(faces, dtype=np.int64)
    parts = [
        igl.embree.line_mesh_intersection(
            np.ascontiguousarray(origins[i : i + BATCH]),
            np.ascontiguousarray(directions[i : i + BATCH]),
            v,
            f,
        )
        for i in range(0, len(origins), BATCH)
    ]
    rows = np.concatenate(parts) if parts else np.zeros((0, 3))
    face = np.rint(rows[:, 0]).astype(np.int64)
    weights = np.stack([1.0 - rows[:, 1] - rows[:, 2], rows[:, 1], rows[:, 2]], axis=1)
    return Hits(face, np.clip(weights, 0.0, 1.0))


def lit_share(
    points: np.ndarray, lights: np.ndarray, vertices: np.ndarray, faces: np.ndarray, tolerance: float
) -> np.ndarray:
    """Share of far lights that each point sees; (N,) in [0, 1].

    points (N, 3); lights (L, 3) unit directions towards them. A ray runs from each light to the point; the
    point is in shadow if something is hit more than `tolerance` metres before it.
    """
    reach = 2.0 * float(np.linalg.norm(np.ptp(np.concatenate([vertices, points]), axis=0))) + 1.0
    towards = np.repeat(lights, len(points), axis=0)
    origins = np.tile(points, (len(lights), 1)) + reach * towards
    hits = cast(origins, -towards, vertices, faces)
    hit = hits.face >= 0
    where = np.einsum("nk,nkd->nd", hits.weights[hit], vertices[faces[hits.face[hit]]])
    distance = np.einsum("nd,nd->n", origins[hit] - where, towards[hit])
    lit = np.ones(len(origins))
    lit[hit] = distance >= reach - tolerance
    return lit.reshape(len(lights), len(points)).mean(axis=0)
