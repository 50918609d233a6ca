"""Placing panels side by side: the atlas of the uv layout and of pictures."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray


def arrange(sizes: Sequence[ArrayLike], gap: float) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Lower left corners (N, 2) of N boxes and the size (2,) of the smallest sheet found for them.

    sizes: width and height of each box; neighbours stay `gap` apart. Boxes go on shelves, highest first; of
    all shelf widths the one is taken that makes the sheet's longer side shortest.
    """
    boxes = np.array(sizes, dtype=np.float64).reshape(-1, 2)
    order = np.argsort(-boxes[:, 1], kind="stable")
    widths = sorted({float((boxes[order[:k], 0] + gap).sum() - gap) for k in range(1, len(boxes) + 1)})
    best: tuple[NDArray[np.float64], NDArray[np.float64]] | None = None
    for width in widths:
        if width < boxes[:, 0].max():
            continue
        corners, size = _shelves(boxes, order, width, gap)
        if best is None or size.max() < best[1].max() - 1e-12:
            best = corners, size
    assert best is not None, "a sheet as wide as all boxes together holds them"
    return best


def _shelves(
    boxes: NDArray[np.float64], order: NDArray[np.int64], width: float, gap: float
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    corners = np.zeros_like(boxes)
    x = y = height = used = 0.0
    for index in order:
        if x > 0.0 and x + boxes[index, 0] > width + 1e-9:
            y, x, height = y + height + gap, 0.0, 0.0
        corners[index] = x, y
        height = max(height, boxes[index, 1])
        x += boxes[index, 0] + gap
        used = max(used, x - gap)
    return corners, np.array([used, y + height])
