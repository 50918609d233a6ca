"""An upper bound of the distance from a triangle to a surface, by laying it over a patch of that surface.

Along a direction g, a triangle t and the faces T of B cast shadows t' and T' on a plane across g. If some
faces cover t' together, they cut t into cells, one above or below each T. The distance to one face is a
convex function, so over a cell it is largest at one of the cell's corners q:

    max_{p in t} d(p, B)  <=  max_T max_q d(q, T)  <=  max_T max_q |q - T(q)|

with T(q) the point of T above or below q. Where B is seen from t at an angle theta, the last is too large by
the factor 1 / cos theta, the one before it by less.

Whether faces cover t' is a matter of topology. Starting from a face below the centroid, every face is added
that lies across an edge whose shadow meets the inside of t'. If no such edge is a border, and no face faces
the other way than the first (a fold), the covered part of the inside of t' is both closed and open in it, and
so all of it.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from muslin.eval.metrics.closest import Surface, point_triangle_distance

MAX_ROUNDS = 24
MAX_FACES = 96
SHRINK = 1e-11  # of t' towards its centroid, so that borders in the same place are not in the way
MARGIN = 1e-7  # by which corners may lie outside and still count: more corners keep the bound a bound
FLATTEST = 1e-7  # area of t' over the square of the longest edge of t
SMALLEST = 1e-12  # area of T' over that of t' that counts as any


@dataclass(frozen=True)
class Cover:
    """Faces of B laid over triangles, M pairs.

    triangle, face (M,)   indices of the two
    beta (M, 3, 3)        barycentric coordinates in t of the corners of T, moved along g into the plane of t
    height (M, 3)         how far they were moved, metres, with sign
    covered (N,)          which triangles their faces cover
    """

    triangle: np.ndarray
    face: np.ndarray
    beta: np.ndarray
    height: np.ndarray
    covered: np.ndarray


def patch_bound(
    corners: np.ndarray, starts: np.ndarray, feet: np.ndarray, surface: Surface, enough: float
) -> np.ndarray:
    """Upper bounds of max d(p, B) over triangles; (N,), metres, infinite where no patch covers a triangle.

    corners (N, 3 corners, 3)   the triangles
    starts (N,), feet (N, 3)    nearest face of B, and its nearest point, to each triangle's centroid
    enough                      bounds at or below it are not sharpened
    """
    bounds = np.full(len(corners), np.inf)
    if len(corners) == 0:
        return bounds
    cover = _cover(corners, starts, feet, surface)
    pair, beta, height = _cell_corners(cover.beta, cover.height)
    triangle = cover.triangle[pair]
    bounds[cover.covered] = 0.0
    np.maximum.at(bounds, triangle, np.abs(height))

    loose = cover.covered & (bounds > enough)
    again = loose[triangle]
    pair, beta, triangle = pair[again], beta[again], triangle[again]
    points = np.einsum("mk,mkc->mc", beta, corners[triangle])
    sharper = np.zeros(len(corners))
    np.maximum.at(sharper, triangle, point_triangle_distance(points, surface.corners[cover.face[pair]]))
    bounds[loose] = np.minimum(bounds[loose], sharper[loose])
    return bounds + 2.0 * SHRINK * longest_edge(corners)


def longest_edge(corners: np.ndarray) -> np.ndarray:
    """Of triangles (N, 3, 3); (N,)."""
    edges = np.roll(corners, -1, axis=1) - corners
    return np.sqrt(np.einsum("nkc,nkc->nk", edges, edges).max(axis=1))


def _cover(corners: np.ndarray, starts: np.ndarray, feet: np.ndarray, surface: Surface) -> Cover:
    to_local, usable = _shadows(corners, starts, feet, surface)
    covered, sign = usable.copy(), np.zeros(len(corners))
    triangle = np.flatnonzero(usable)
    if len(triangle) == 0:
        none = np.zeros(0, dtype=np.int64)
        return Cover(none, none, np.zeros((0, 3, 3)), np.zeros((0, 3)), covered)
    face = starts[triangle]
    known = triangle * len(surface.faces) + face
    found: list[tuple[np.ndarray, ...]] = []
    for _ in range(MAX_ROUNDS):
        local = np.matmul(surface.corners[face] - corners[triangle, 0][:, None], to_local[triangle])
        beta = np.concatenate([1.0 - local[..., :1] - local[..., 1:2], local[..., :2]], axis=2)
        found.append((triangle, face, beta, local[..., 2]))
        lines = np.cross(beta, np.roll(beta, -1, axis=1))
        area = np.einsum("mk,mk->m", beta[:, 2], lines[:, 0])
        if len(found) == 1:
            sign[triangle] = np.where(np.abs(area) > SMALLEST, np.sign(area), np.nan)
        meets = _meets(beta, lines)
        across = surface.neighbours[face]
        bad = ~(area * sign[triangle] >= -SMALLEST) | (meets & (across < 0)).any(axis=1)
        covered[triangle[bad]] = False
        wanted = meets & covered[triangle][:, None]
        keys = np.repeat(triangle, wanted.sum(axis=1)) * len(surface.faces) + across[wanted]
        keys = _new(keys, known)
        if len(keys) == 0:
            break
        known = np.sort(np.concatenate([known, keys]))
        triangle, face = np.divmod(keys, len(surface.faces))
        covered &= np.bincount(known // len(surface.faces), minlength=len(corners)) <= MAX_FACES
    else:
        covered[triangle] = False
    parts = [np.concatenate(part) for part in zip(*found, strict=True)]
    keep = covered[parts[0]]
    return Cover(parts[0][keep], parts[1][keep], parts[2][keep], parts[3][keep], covered)


def _new(keys: np.ndarray, known: np.ndarray) -> np.ndarray:
    """Each of `keys` once, rising, that is not in the sorted `known`."""
    keys = np.sort(keys)
    keys = keys[np.diff(keys, prepend=-1) > 0]
    slot = np.minimum(np.searchsorted(known, keys), len(known) - 1)
    return keys[known[slot] != keys]


def _shadows(
    corners: np.ndarray, starts: np.ndarray, feet: np.ndarray, surface: Surface
) -> tuple[np.ndarray, np.ndarray]:
    """(N, 3, 3) that turn x - t_0 (rows) into (beta_1, beta_2, height), and which triangles allow it.

    g points from the centroid to its nearest point; along the normal of that face if they are in one place.
    """
    offset = feet - corners.mean(axis=1)
    length = np.linalg.norm(offset, axis=1)
    longest = longest_edge(corners)
    near = length < 1e-6 * longest
    if near.any():
        a, b, c = surface.corners[starts[near]].swapaxes(0, 1)
        offset[near] = np.cross(b - a, c - a)
        length[near] = np.linalg.norm(offset[near], axis=1)
    g = offset / np.where(length > 0, length, 1.0)[:, None]
    first, second = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    inverse = np.stack([np.cross(second, g), np.cross(g, first), np.cross(first, second)], axis=2)
    volume = np.einsum("nc,nc->n", first, inverse[:, :, 0])
    usable = (length > 0) & (np.abs(volume) > FLATTEST * longest**2)
    return inverse / np.where(usable, volume, 1.0)[:, None, None], usable


def _meets(beta: np.ndarray, lines: np.ndarray) -> np.ndarray:
    """(M, 3) whether the edge from corner i to i + 1 of T' meets t', slightly shrunk.

    Two convex figures are apart if and only if a line along an edge of either parts them. `lines`, the cross
    products of the ends in barycentric coordinates, are on which side of the edge the corners of t' lie.
    """
    ends = np.maximum(beta, np.roll(beta, -1, axis=1)).min(axis=2) > SHRINK / 3.0
    sides = (1.0 - SHRINK) * lines + SHRINK * lines.mean(axis=2, keepdims=True)
    return ends & (sides.min(axis=2) <= 0.0) & (sides.max(axis=2) >= 0.0)


def _cell_corners(beta: np.ndarray, height: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Corners of all cells: their pair (K,), barycentric coordinates in t (K, 3), heights (K,).

    They are corners of T over t, corners of t over T, and crossings of edges.
    """
    inside = np.nonzero((beta >= -MARGIN).all(axis=2))
    parts = [(inside[0], beta[inside], height[inside])]

    lines = np.cross(np.roll(beta, -1, axis=1), np.roll(beta, -2, axis=1))
    area = np.einsum("mk,mk->m", beta[:, 0], lines[:, 0])
    solid = np.abs(area) > SMALLEST
    share = lines / np.where(solid, area, 1.0)[:, None, None]
    pair, corner = np.nonzero((share >= -MARGIN).all(axis=1) & solid[:, None])
    weights = share[pair, :, corner]
    parts.append((pair, np.eye(3)[corner], np.einsum("ki,ki->k", weights, height[pair])))

    for i in range(3):
        p, q = beta[:, i], beta[:, (i + 1) % 3]
        pair, side = np.nonzero(p * q < 0.0)
        start, end = p[pair], q[pair]
        row = np.arange(len(pair))
        s = start[row, side] / (start[row, side] - end[row, side])
        at = start + s[:, None] * (end - start)
        within = (at >= -MARGIN).all(axis=1)
        pair, s = pair[within], s[within]
        z = height[pair, i] + s * (height[pair, (i + 1) % 3] - height[pair, i])
        parts.append((pair, at[within], z))
    pairs, places, heights = zip(*parts, strict=True)
    return np.concatenate(pairs), np.concatenate(places), np.concatenate(heights)
