"""Rectangular sheets in triangulations of every kind."""

from __future__ import annotations

from typing import Literal, get_args

import numpy as np

from muslin.eval.validate.meshes import delaunay, flat_mesh, rectangle
from muslin.garments.mesh import GarmentMesh

Kind = Literal["structured", "alternating", "irregular", "turned"]
KINDS: tuple[Kind, ...] = get_args(Kind)


def sheet(kind: Kind, width: float, length: float, side: float, seed: int = 0) -> GarmentMesh:
    """A sheet of `width` along x by `length` along y, with triangles of about `side`."""
    nx, ny = round(width / side), round(length / side)
    if kind == "structured" or kind == "alternating":
        return rectangle(width, length, nx, ny, kind)
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
    return flat_mesh(points, delaunay(points))


def _apart(points: np.ndarray, distance: float) -> np.ndarray:
    """The points that are further than `distance` from all that were taken before them."""
    taken = np.zeros((0, 2))
    for point in points:
        if not len(taken) or ((taken - point) ** 2).sum(axis=1).min() > distance**2:
            taken = np.concatenate([taken, point[None]])
    return taken
