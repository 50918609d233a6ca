"""Rectangular sheets in triangulations of every kind."""

from __future__ import annotations

import numpy as np
from scipy.spatial import Delaunay

from muslin.garments.mesh import GarmentMesh
from tests.sim.conftest import make_flat_mesh

KINDS = ("structured", "alternating", "irregular", "turned")


def sheet(kind: str, width: float, length: float, side: float, seed: int = 0) -> GarmentMesh:
    """A sheet of `width` along x by `length` along y, with triangles of about `side`."""
    nx, ny = round(width / side), round(length / side)
    if kind in ("structured", "alternating"):
        return _grid(nx, ny, width, length, alternating=kind == "alternating")
    rng = np.random.default_rng(seed)
    if kind == "irregular":
        inner = rng.uniform([0.0, 0.0], [width, length], (20 * nx * ny, 2))
        inner = _apart(inner, 0.7 * side)
    else:
        # Equilateral triangles, turned against the border.
        steps = np.arange(-3 * (nx + ny), 3 * (nx + ny))
        i, j = (a.ravel() for a in np.meshgrid(steps, steps))
        lattice = side * np.stack([i + 0.5 * j, np.sqrt(0.75) * j], axis=1)
        c, s = np.cos(turn := rng.uniform(0.0, np.pi / 3)), np.sin(turn)
        inner = lattice @ np.array([[c, s], [-s, c]]) + rng.uniform(0.0, side, 2)
    margin = 0.5 * side
    inside = ((inner > margin) & (inner < np.array([width, length]) - margin)).all(axis=1)
    x, y = np.linspace(0.0, width, nx + 1), np.linspace(0.0, length, ny + 1)
    border = [(a, b) for a in x for b in (0.0, length)] + [(a, b) for a in (0.0, width) for b in y[1:-1]]
    points = np.concatenate([np.array(border), inner[inside]])
    faces = Delaunay(points).simplices
    u, v = points[faces[:, 1]] - points[faces[:, 0]], points[faces[:, 2]] - points[faces[:, 0]]
    area = 0.5 * (u[:, 0] * v[:, 1] - u[:, 1] * v[:, 0])
    faces = np.where(area[:, None] < 0.0, faces[:, ::-1], faces)
    return make_flat_mesh(points, faces[np.abs(area) > 1e-6 * side**2])


def _grid(nx: int, ny: int, width: float, length: float, alternating: bool) -> GarmentMesh:
    i, j = (a.ravel() for a in np.meshgrid(np.arange(nx + 1), np.arange(ny + 1), indexing="ij"))
    corner = np.arange((nx + 1) * (ny + 1)).reshape(nx + 1, ny + 1)
    a, b, c, d = (q.ravel() for q in (corner[:-1, :-1], corner[1:, :-1], corner[1:, 1:], corner[:-1, 1:]))
    other = ((i + j) % 2 == 1)[a] if alternating else np.zeros(len(a), bool)
    first = np.where(other[:, None], np.stack([a, b, d], 1), np.stack([a, b, c], 1))
    second = np.where(other[:, None], np.stack([b, c, d], 1), np.stack([a, c, d], 1))
    points = np.stack([width * i / nx, length * j / ny], axis=1)
    return make_flat_mesh(points, np.concatenate([first, second]))


def _apart(points: np.ndarray, distance: float) -> np.ndarray:
    """The points that are further than `distance` from all that were taken before them."""
    taken = np.zeros((0, 2))
    for point in points:
        if not len(taken) or ((taken - point) ** 2).sum(axis=1).min() > distance**2:
            taken = np.concatenate([taken, point[None]])
    return taken
