"""Judging frames, whoever made them: intersections by ipctk, strain against the panels."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from benchmarks.setting import Setting
from muslin.sim.dataset.intersections import count_intersections


@dataclass(frozen=True)
class Verdict:
    """Over all frames: crossing (edge, triangle) pairs, frames with any, the largest principal stretch.

    A frame with coordinates that are not finite is `broken`: it is counted there and nowhere else.
    """

    frames: int
    intersecting: int
    cloth_cloth: int
    cloth_body: int
    broken: int
    largest_stretch: float


def judge(setting: Setting, positions: NDArray[np.float64]) -> Verdict:
    """Count what is wrong with frames (T, V, 3) of a setting; frame k belongs to its body's frame k + 1.

    Faces of the body that lie within the body itself are left out. ValueError for frames of another shape.
    """
    expected = (setting.frames, *setting.positions.shape)
    if positions.shape != expected:
        raise ValueError(f"positions have shape {positions.shape}; the setting asks for {expected}")
    inverse_rest = np.linalg.inv(edge_matrices(setting.panel_vertices, setting.panel_faces))
    intersecting = cloth_cloth = cloth_body = broken = 0
    stretch = 0.0
    for x, body, hidden in zip(positions, setting.body[1:], setting.hidden[1:], strict=True):
        if not np.isfinite(x).all():
            broken += 1
            continue
        counts = count_intersections(x, setting.faces, body, setting.body_faces[~hidden])
        cloth_cloth += counts.cloth_cloth
        cloth_body += counts.cloth_body
        intersecting += counts.cloth_cloth + counts.cloth_body > 0
        gradient = edge_matrices(x, setting.faces) @ inverse_rest
        stretch = max(stretch, float(np.linalg.svd(gradient, compute_uv=False).max()))
    return Verdict(len(positions), intersecting, cloth_cloth, cloth_body, broken, stretch)


def edge_matrices(vertices: NDArray[np.float64], faces: NDArray[np.int32]) -> NDArray[np.float64]:
    """(F, d, 2): two edges of each triangle as columns, for vertices (V, d)."""
    corners = vertices[faces]
    return np.stack([corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]], axis=2)
