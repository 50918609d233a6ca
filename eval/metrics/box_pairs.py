"""Which bounding boxes of two sets overlap: a tree of boxes, descended for all pairs at once."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from muslin.garments.errors import InputError

BITS = 10  # of a Morton code, an axis
MOST_PAIRS = 4_000_000
"""A garment that crosses body or itself nearly everywhere has some thousands; noise has tens of millions."""


@dataclass(frozen=True)
class BoxTree:
    """A complete binary tree over boxes in Morton order.

    order    (n,) index of the box in each leaf
    low      level by level from the root, (3, 2^level) float32, rounded down: smallest corner of a node's box
    high     the largest corner, rounded up; of a node without boxes -infinity, so that it overlaps nothing
    """

    order: NDArray[np.int64]
    low: tuple[NDArray[np.float32], ...]
    high: tuple[NDArray[np.float32], ...]

    @property
    def depth(self) -> int:
        return len(self.low) - 1


def box_tree(low: NDArray[np.float64], high: NDArray[np.float64]) -> BoxTree:
    """The tree over boxes with corners low <= high, (n, 3) each; n >= 1."""
    order = np.argsort(_morton(0.5 * (low + high)), kind="stable")
    depth = int(np.ceil(np.log2(len(order))))
    lows = [np.full((3, 2**depth), np.inf, np.float32)]
    highs = [np.full((3, 2**depth), -np.inf, np.float32)]
    lows[0][:, : len(order)] = np.nextafter(low[order].T.astype(np.float32), np.float32(-np.inf))
    highs[0][:, : len(order)] = np.nextafter(high[order].T.astype(np.float32), np.float32(np.inf))
    for _ in range(depth):
        lows.append(np.minimum(lows[-1][:, 0::2], lows[-1][:, 1::2]))
        highs.append(np.maximum(highs[-1][:, 0::2], highs[-1][:, 1::2]))
    return BoxTree(order, tuple(lows[::-1]), tuple(highs[::-1]))


def overlapping(a: BoxTree, b: BoxTree) -> NDArray[np.int64]:
    """(K, 2) all pairs of a box of `a` and a box of `b` with a common point, and a few that only nearly have.

    Boxes are rounded outwards to single precision, so no pair is missed.
    """
    i = j = np.zeros(1, dtype=np.int32)
    level_a = level_b = 0
    i, j = _meeting(a, 0, i, b, 0, j)
    while level_a < a.depth or level_b < b.depth:
        # The tree with more levels left below goes first: its boxes are the larger ones.
        if a.depth - level_a >= b.depth - level_b:
            level_a += 1
            i, j = np.concatenate([2 * i, 2 * i + 1]), np.concatenate([j, j])
        else:
            level_b += 1
            i, j = np.concatenate([i, i]), np.concatenate([2 * j, 2 * j + 1])
        i, j = _meeting(a, level_a, i, b, level_b, j)
    return np.stack([a.order[i], b.order[j]], axis=1)


def overlapping_within(tree: BoxTree) -> NDArray[np.int64]:
    """(K, 2) all pairs i < j of boxes of one tree, as `overlapping` gives them."""
    same = np.zeros(1, dtype=np.int32)
    i = j = np.zeros(0, dtype=np.int32)
    for level in range(1, tree.depth + 1):
        left, right = 2 * same, 2 * same + 1
        i, j = (
            np.concatenate([2 * i, 2 * i, 2 * i + 1, 2 * i + 1, left]),
            np.concatenate([2 * j, 2 * j + 1, 2 * j, 2 * j + 1, right]),
        )
        same = np.concatenate([left, right])
        i, j = _meeting(tree, level, i, tree, level, j)
    return np.sort(np.stack([tree.order[i], tree.order[j]], axis=1), axis=1)


def _meeting(
    a: BoxTree, level_a: int, i: NDArray[np.int32], b: BoxTree, level_b: int, j: NDArray[np.int32]
) -> tuple[NDArray[np.int32], NDArray[np.int32]]:
    """The pairs of nodes whose boxes overlap; axis by axis, since most part on the first.

    Raises InputError for more than `MOST_PAIRS`.
    """
    for axis in (1, 0, 2):
        meet = a.low[level_a][axis].take(i) <= b.high[level_b][axis].take(j)
        meet &= b.low[level_b][axis].take(j) <= a.high[level_a][axis].take(i)
        i, j = i[meet], j[meet]
    if len(i) > MOST_PAIRS:
        raise InputError(
            f"intersections: more than {MOST_PAIRS} pairs of triangles come near one another; such a surface "
            "is no garment: check what predicts it, and leave contact out (--metrics)"
        )
    return i, j


def _morton(points: NDArray[np.float64]) -> NDArray[np.int32]:
    """Morton codes of points (n, 3): bits of the three coordinates taken in turn, on a grid over their
    box."""
    least = points.min(axis=0)
    extent = float((points.max(axis=0) - least).max())
    cells = ((points - least) / (extent or 1.0) * (2**BITS - 1)).astype(np.int32)
    for shift, mask in ((16, 0x030000FF), (8, 0x0300F00F), (4, 0x030C30C3), (2, 0x09249249)):
        cells = (cells | (cells << shift)) & mask
    return cells[:, 0] | (cells[:, 1] << 1) | (cells[:, 2] << 2)
