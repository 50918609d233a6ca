"""What a picture shows: coloured surfaces."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

SKIN = (0.80, 0.62, 0.52)
FABRIC = (0.20, 0.38, 0.58)
OBSTACLE = (0.72, 0.71, 0.69)


@dataclass(frozen=True, eq=False)
class Layer:
    """One triangle mesh with its look.

    vertices    (V, 3) float64, metres
    faces       (F, 3) int
    colour      (3,) or (V, 3), sRGB in [0, 1]
    sheet       a cloth, seen and lit from both sides; otherwise a solid
    gloss       strength of the highlight, 0 (cotton) to 1
    seams       (F, 3) bool: the edge from corner k to corner k + 1 is drawn as a seam; None for none
    flat_light  colours are data (a heat map): shade them only as much as the shape needs to be read
    """

    vertices: np.ndarray
    faces: np.ndarray
    colour: np.ndarray
    sheet: bool = False
    gloss: float = 0.1
    seams: np.ndarray | None = None
    flat_light: bool = False


def vertex_normals(vertices: np.ndarray, faces: np.ndarray) -> np.ndarray:
    """Unit normals, averaged over the triangles around a vertex by area; (V, 3)."""
    corners = vertices[faces]
    cross = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normals = np.stack(
        [
            np.bincount(faces.ravel(), weights=np.repeat(cross[:, k], 3), minlength=len(vertices))
            for k in range(3)
        ],
        axis=1,
    )
    return normals / np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-300)


def seam_edges(faces: np.ndarray, panel_faces: np.ndarray) -> np.ndarray:
    """Which edges of the faces are seams or hems: those with one triangle only in panel connectivity.

    faces, panel_faces   (F, 3) int, the same triangles in sewn and in panel indices
    returns              (F, 3) bool, the edge from corner k to corner k + 1
    """
    start = panel_faces.astype(np.int64)
    end = np.roll(start, -1, axis=1)
    n = int(panel_faces.max(initial=0)) + 1
    key = np.minimum(start, end) * n + np.maximum(start, end)
    _, inverse, count = np.unique(key.ravel(), return_inverse=True, return_counts=True)
    return (count[inverse.ravel()] == 1).reshape(faces.shape)
