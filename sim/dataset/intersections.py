"""Exact intersections of cloth with itself and with a body, by IPC Toolkit.

A pair is an edge and a triangle without a common vertex that meet; ipctk decides it with Shewchuk's exact
orientation predicates, so a count of zero means that no two triangles cross. Pairs within the body are left
out.
"""

from __future__ import annotations

from dataclasses import dataclass

import ipctk
import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True)
class IntersectionCounts:
    """Numbers of crossing (edge, triangle) pairs."""

    cloth_cloth: int
    cloth_body: int


def count_intersections(
    cloth_vertices: np.ndarray, cloth_faces: np.ndarray, body_vertices: np.ndarray, body_faces: np.ndarray
) -> IntersectionCounts:
    """Count the crossing pairs of a cloth (V, 3), (F, 3) with itself and with a body (N, 3), (M, 3); metres.

    Give the unmasked faces of the body only. Coordinates must be finite.
    """
    scene = _scene(cloth_vertices, cloth_faces, body_vertices, body_faces)
    pairs = _crossing_pairs(scene)
    of_cloth = (scene.edges[pairs[:, 0], 0] < scene.num_cloth) & (pairs[:, 1] < len(cloth_faces))
    return IntersectionCounts(int(of_cloth.sum()), int((~of_cloth).sum()))


def crossed_body_faces(
    cloth_vertices: np.ndarray, cloth_faces: np.ndarray, body_vertices: np.ndarray, body_faces: np.ndarray
) -> NDArray[np.int32]:
    """Which faces of the body the cloth crosses, rising; without them no pair of cloth and body is left."""
    scene = _scene(cloth_vertices, cloth_faces, body_vertices, body_faces)
    pairs = _crossing_pairs(scene)
    crossed = np.zeros(len(scene.faces), dtype=bool)
    crossed[pairs[:, 1]] = True
    count = len(scene.vertices)
    sides = np.sort(scene.faces[:, [[0, 1], [1, 2], [2, 0]]], axis=2) @ [count, 1]
    crossed |= np.isin(sides, np.sort(scene.edges[pairs[:, 0]], axis=1) @ [count, 1]).any(axis=1)
    return np.flatnonzero(scene.kept)[crossed[len(cloth_faces) :]].astype(np.int32)


@dataclass(frozen=True)
class Crossings:
    """Points (K,) in which an edge of one triangle pierces another one.

    faces      (K, 2) the triangle of the edge and the one that it pierces: below the number of cloth faces of
               the cloth, from there on of the body
    weights    (K, 2, 3) barycentric coordinates of the point in either
    """

    faces: NDArray[np.int64]
    weights: NDArray[np.float64]

    def __len__(self) -> int:
        return len(self.faces)


def find_crossings(
    cloth_vertices: np.ndarray, cloth_faces: np.ndarray, body_vertices: np.ndarray, body_faces: np.ndarray
) -> Crossings:
    """All points in which the cloth crosses itself or the body, as `count_intersections` counts them.

    Which pairs cross is exact, where they do is rounded. Faces of the body are numbered among those that the
    cloth might touch.
    """
    scene = _scene(cloth_vertices, cloth_faces, body_vertices, body_faces)
    pairs = _crossing_pairs(scene)
    edges, pierced = scene.edges[pairs[:, 0]], scene.faces[pairs[:, 1]]
    a, b, c = scene.vertices[pierced].swapaxes(0, 1)
    p, q = scene.vertices[edges].swapaxes(0, 1)
    normal = np.cross(b - a, c - a)
    above, below = (np.einsum("ij,ij->i", normal, end - a) for end in (p, q))
    rise = above - below
    fraction = np.clip(above / np.where(rise == 0.0, 1.0, rise), 0.0, 1.0)[:, None]
    x = p + fraction * (q - p)
    square = np.einsum("ij,ij->i", normal, normal)
    second = np.einsum("ij,ij->i", np.cross(x - a, c - a), normal) / square
    third = np.einsum("ij,ij->i", np.cross(b - a, x - a), normal) / square
    face = _face_of_edge(scene.faces, edges, len(scene.vertices))
    on_edge = np.where(scene.faces[face] == edges[:, :1], 1.0 - fraction, 0.0)
    on_edge += np.where(scene.faces[face] == edges[:, 1:], fraction, 0.0)
    on_face = np.stack([1.0 - second - third, second, third], axis=1)
    return Crossings(np.stack([face, pairs[:, 1]], axis=1), np.stack([on_edge, on_face], axis=1))


def _face_of_edge(faces: np.ndarray, edges: np.ndarray, count: int) -> NDArray[np.int64]:
    """(K,) one of the faces that each edge (K, 2) belongs to."""
    sides = np.sort(faces[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2).astype(np.int64), axis=1) @ [count, 1]
    order = np.argsort(sides, kind="stable")
    return order[np.searchsorted(sides[order], np.sort(edges.astype(np.int64), axis=1) @ [count, 1])] // 3


@dataclass(frozen=True)
class _Scene:
    """Cloth, then body, as one mesh; of the body only the faces `kept` (M,), which the cloth might touch."""

    vertices: np.ndarray
    edges: np.ndarray
    faces: np.ndarray
    num_cloth: int
    kept: np.ndarray


def _scene(
    cloth_vertices: np.ndarray, cloth_faces: np.ndarray, body_vertices: np.ndarray, body_faces: np.ndarray
) -> _Scene:
    cloth = np.asarray(cloth_vertices, dtype=np.float64)
    kept = _overlaps(body_vertices[body_faces], cloth.min(axis=0), cloth.max(axis=0))
    near = body_faces[kept]
    used, local = np.unique(near, return_inverse=True)
    vertices = np.asfortranarray(np.concatenate([cloth, body_vertices[used]]))
    body = local.reshape(near.shape) + len(cloth)
    faces = np.asfortranarray(np.concatenate([cloth_faces, body]).astype(np.int32))
    return _Scene(vertices, np.asfortranarray(ipctk.edges(faces)), faces, len(cloth), kept)


def _overlaps(triangles: np.ndarray, low: np.ndarray, high: np.ndarray) -> np.ndarray:
    """Which triangles (M, 3, 3) have a bounding box that meets the box [low, high]: no other can touch the
    cloth."""
    return np.logical_and((triangles.max(axis=1) >= low), (triangles.min(axis=1) <= high)).all(axis=1)


def _crossing_pairs(scene: _Scene) -> np.ndarray:
    """Indices of edge and face (K, 2) of each pair that crosses."""
    vertices, edges, faces = scene.vertices, scene.edges, scene.faces
    mesh = ipctk.CollisionMesh(vertices, edges, faces)
    mesh.can_collide = ipctk.make_static_obstacle_filter(scene.num_cloth)
    if not ipctk.has_intersections(mesh, vertices, ipctk.LBVH()):
        return np.zeros((0, 2), dtype=np.int64)
    broad_phase = ipctk.LBVH()
    broad_phase.can_vertices_collide = ipctk.make_static_obstacle_filter(scene.num_cloth)
    extent = float(np.linalg.norm(np.ptp(vertices, axis=0)))
    # LBVH rounds boxes to float32; ipctk's own test inflates them by the same share.
    broad_phase.build(vertices, edges, faces, 1e-6 * extent)
    found = broad_phase.detect_edge_face_candidates()
    pairs = np.array([(pair.edge_id, pair.face_id) for pair in found], dtype=np.int64).reshape(-1, 2)
    pairs = pairs[_may_pierce(vertices, edges[pairs[:, 0]], faces[pairs[:, 1]])]
    crossing = [
        ipctk.is_edge_intersecting_triangle(*vertices[edges[e]], *vertices[faces[f]]) for e, f in pairs
    ]
    return pairs[np.array(crossing, dtype=bool)]


def _may_pierce(vertices: np.ndarray, edges: np.ndarray, faces: np.ndarray) -> np.ndarray:
    """Which edges (K, 2) do not lie on one side of the plane of their triangle (K, 3), beyond any rounding.

    Spares the exact test, a call a pair, nearly all pairs. The determinant (b - a) x (c - a) . (p - a) is off
    by some 1e-15 |b - a| |c - a| |p - a|; pairs within a thousand times that stay for the exact test.
    """
    a, b, c = vertices[faces].swapaxes(0, 1)
    normal = np.cross(b - a, c - a)
    scale = np.linalg.norm(b - a, axis=1) * np.linalg.norm(c - a, axis=1)
    sides = []
    for end in vertices[edges].swapaxes(0, 1):
        volume = np.einsum("ij,ij->i", normal, end - a)
        sure = np.abs(volume) > 1e-12 * scale * np.linalg.norm(end - a, axis=1)
        sides.append(np.where(sure, np.sign(volume), 0.0))
    return sides[0] * sides[1] <= 0.0
