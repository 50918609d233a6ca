"""Quality triangulation of one panel whose boundary is already sampled."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import Delaunay, cKDTree

from muslin.garments.errors import InputError
from muslin.garments.half_edges import half_edges
from muslin.garments.mesh import signed_areas

CLEARANCE = 0.62  # least distance of a lattice point from the boundary, in edge lengths
LONGEST = 1.6  # of interior edges, in edge lengths; longer ones are split
SMOOTHING_STEPS, SPLIT_ROUNDS = 20, 4
_CHUNK = 1024  # points tested against a polygon at once


def triangulate_polygon(
    boundary: NDArray[np.float64], edge_length: float, rng: np.random.Generator, name: str
) -> tuple[NDArray[np.float64], NDArray[np.int32]]:
    """Points (N, 2), the B boundary points first, and counter-clockwise faces (F, 3) int32 of a polygon.

    boundary: (B, 2), metres, counter-clockwise, simple, sampled at about `edge_length`; it is kept as it is.

    A hexagonal lattice of random offset and angle fills the polygon. Then Delaunay triangulation alternates
    with moves of every interior point i to the area-weighted mean of its triangles' circumcentres c_f,

        x_i = sum_f |f| c_f / sum_f |f|,

    optimal Delaunay triangulation (L. Chen and M. Holst 2011, "Efficient mesh optimization schemes based on
    optimal Delaunay triangulations"). In obtuse triangles the centroid stands for the circumcentre, which may
    lie outside; that keeps points near the boundary inside. Where the lattice left a gap, long edges are
    split.

    Raises InputError if the polygon is too narrow for the edge length.
    """
    points = np.concatenate([boundary, _lattice(boundary, edge_length, rng)])
    fixed = len(boundary)
    for _ in range(SPLIT_ROUNDS):
        faces = _constrained_delaunay(points, fixed)
        for _ in range(SMOOTHING_STEPS if len(points) > fixed else 0):
            points[fixed:] = _optimal_positions(points, faces)[fixed:]
            faces = _constrained_delaunay(points, fixed)
        gaps = _long_edges(points, faces, LONGEST * edge_length)
        if len(gaps) == 0:
            break
        points = np.concatenate([points, points[gaps].mean(axis=1)])
    faces = _constrained_delaunay(points, fixed)
    missing = _missing_edges(faces, fixed)
    if len(missing) or len(faces) != 2 * len(points) - fixed - 2:
        raise InputError(
            f"panel '{name}' cannot be triangulated at edge length {edge_length:g} m: it is too narrow; "
            "choose a smaller edge length"
        )
    return points, faces


def contains(polygon: NDArray[np.float64], points: NDArray[np.float64]) -> NDArray[np.bool_]:
    """(N,) whether points (N, 2) lie inside the closed polygon (B, 2), by the even-odd rule."""
    ax, ay = polygon.T
    bx, by = np.roll(polygon, -1, axis=0).T
    slope = (bx - ax) / np.where(by == ay, 1.0, by - ay)  # level edges span no height and never count
    inside = np.empty(len(points), dtype=bool)
    for start in range(0, len(points), _CHUNK):
        x, y = points[start : start + _CHUNK, :, None].transpose(1, 0, 2)
        crossed = ((ay > y) != (by > y)) & (x < ax + slope * (y - ay))
        inside[start : start + _CHUNK] = crossed.sum(axis=1) % 2 == 1
    return inside


def _lattice(
    boundary: NDArray[np.float64], edge_length: float, rng: np.random.Generator
) -> NDArray[np.float64]:
    """Hexagonal lattice points inside the polygon, clear of its boundary."""
    centre = 0.5 * (boundary.min(axis=0) + boundary.max(axis=0))
    radius = 0.5 * float(np.linalg.norm(np.ptp(boundary, axis=0))) + 2.0 * edge_length
    count = int(np.ceil(radius / (edge_length * np.sqrt(0.75)))) + 1
    i, j = np.meshgrid(np.arange(-count, count + 1), np.arange(-count, count + 1), indexing="ij")
    lattice = edge_length * np.stack([i + 0.5 * (j % 2), np.sqrt(0.75) * j], axis=-1).reshape(-1, 2)
    angle, offset = rng.uniform(0.0, np.pi / 3.0), rng.uniform(-0.5, 0.5, size=2) * edge_length
    cos, sin = np.cos(angle), np.sin(angle)
    lattice = (lattice + offset) @ np.array([[cos, sin], [-sin, cos]]) + centre
    lattice = lattice[contains(boundary, lattice)]
    steps = np.arange(8)[:, None, None] / 8.0
    dense = (boundary + steps * (np.roll(boundary, -1, axis=0) - boundary)).reshape(-1, 2)
    distance, _ = cKDTree(dense).query(lattice)
    return lattice[distance > CLEARANCE * edge_length]


def _constrained_delaunay(points: NDArray[np.float64], fixed: int) -> NDArray[np.int32]:
    """Counter-clockwise Delaunay triangles inside the polygon of the first `fixed` points.

    Interior points stay clear of the boundary, so its edges are Delaunay edges; the caller checks that none
    is missing. Then a triangle with an interior point lies inside, and only the others need the centroid
    test.
    """
    faces = Delaunay(points).simplices.astype(np.int32)
    areas = signed_areas(points, faces)
    faces[areas < 0.0] = faces[areas < 0.0][:, [0, 2, 1]]
    scale = np.ptp(points[:fixed], axis=0).max() ** 2
    keep = np.abs(areas) > 1e-12 * scale
    outer = np.flatnonzero(keep & (faces < fixed).all(axis=1))
    keep[outer] = contains(points[:fixed], points[faces[outer]].mean(axis=1))
    return faces[keep]


def _optimal_positions(points: NDArray[np.float64], faces: NDArray[np.int32]) -> NDArray[np.float64]:
    a, b, c = points[faces[:, 0]], points[faces[:, 1]], points[faces[:, 2]]
    area = signed_areas(points, faces)
    u, v = b - a, c - a
    uu, vv, ww = (u * u).sum(axis=1), (v * v).sum(axis=1), ((c - b) ** 2).sum(axis=1)
    centre = a + (
        np.stack([v[:, 1] * uu - u[:, 1] * vv, u[:, 0] * vv - v[:, 0] * uu], axis=1) / (4.0 * area[:, None])
    )
    obtuse = 2.0 * np.max([uu, vv, ww], axis=0) > uu + vv + ww
    centre[obtuse] = ((a + b + c) / 3.0)[obtuse]
    weight = np.bincount(faces.ravel(), weights=np.repeat(area, 3), minlength=len(points))
    weight[weight == 0.0] = 1.0
    mean = [
        np.bincount(faces.ravel(), weights=np.repeat(area * centre[:, k], 3), minlength=len(points))
        for k in range(2)
    ]
    return np.stack(mean, axis=1) / weight[:, None]


def _long_edges(points: NDArray[np.float64], faces: NDArray[np.int32], longest: float) -> NDArray[np.int32]:
    """(n, 2) interior edges longer than `longest` that are the longest of both their triangles."""
    half = np.stack([faces, np.roll(faces, -1, axis=1)], axis=-1)
    lengths = np.linalg.norm(points[half[..., 0]] - points[half[..., 1]], axis=-1)
    chosen = half[np.arange(len(faces)), lengths.argmax(axis=1)][lengths.max(axis=1) > longest]
    edges, counts = np.unique(np.sort(chosen, axis=1), axis=0, return_counts=True)
    return edges[counts == 2]


def _missing_edges(faces: NDArray[np.int32], fixed: int) -> NDArray[np.int64]:
    """Boundary edges i -> i + 1 that no triangle has."""
    half = half_edges(faces)
    present = half[:, 0][(half[:, 0] < fixed) & (half[:, 1] == (half[:, 0] + 1) % fixed)]
    return np.setdiff1d(np.arange(fixed), present)
