"""Surfaces whose normals, curvatures and strains are known."""

from __future__ import annotations

import numpy as np
import trimesh

from muslin.eval.validate.meshes import Triangulation, rectangle


def sheet(
    width: float, length: float, nx: int, ny: int, kind: Triangulation = "alternating"
) -> tuple[np.ndarray, np.ndarray]:
    """Panel coordinates (V, 2), metres, and faces (F, 3) of a rectangle, normals to +z when laid flat."""
    mesh = rectangle(width, length, nx, ny, kind)
    return mesh.panel_vertices, mesh.panel_faces


def lifted(uv: np.ndarray, z: np.ndarray | float = 0.0) -> np.ndarray:
    """(V, 3): the sheet laid flat, at heights z."""
    return np.column_stack([uv, np.broadcast_to(z, len(uv))])


def rolled(uv: np.ndarray, radius: float) -> np.ndarray:
    """(V, 3): the sheet rolled isometrically along x onto a cylinder about the y axis, normals outward."""
    return np.column_stack([radius * np.sin(uv[:, 0] / radius), uv[:, 1], radius * np.cos(uv[:, 0] / radius)])


def sphere(subdivisions: int, radius: float) -> tuple[np.ndarray, np.ndarray]:
    """A closed icosphere, normals outward."""
    ball = trimesh.creation.icosphere(subdivisions, radius)
    return np.array(ball.vertices), np.array(ball.faces)


def turned(points: np.ndarray, seed: int = 0) -> np.ndarray:
    """The points under some rigid motion."""
    q, _ = np.linalg.qr(np.random.default_rng(seed).normal(size=(3, 3)))
    q[:, 0] *= np.sign(np.linalg.det(q))
    return points @ q.T + np.array([0.4, -1.3, 0.2])
