"""Collider vertices that give way: between parts of a body that cut into each other."""

from __future__ import annotations

import igl
import numpy as np
import warp as wp
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from muslin.sim.contact.system import ContactSystem

OPPOSITE = 0.02
"""Metres within which a part of the collider that faces another is its opposite."""


def yield_to_cloth(
    contact: ContactSystem, yielding: NDArray[np.bool_], x: wp.array, remaining: NDArray[np.float64]
) -> None:
    """Close in no further on cloth between `yielding` (N,) vertices and what is opposite.

    Those with cloth within half the contact range get the motion of the nearest vertex with an opposite
    normal, or the mean of both where that one may yield too. Changes rows of `remaining` (V + N, 3), metres.
    """
    first = len(x) - len(yielding)
    squeezing = np.flatnonzero(yielding & contact.near(x, 0.5 * contact.settings.range)[first:])
    if len(squeezing) == 0:
        return
    vertices = x.numpy()[first:]
    normals = igl.per_vertex_normals(vertices, contact.collider_faces.astype(np.int64))
    tree = cKDTree(vertices)
    motion = remaining[first:]
    before = motion.copy()
    for i, around in zip(squeezing, tree.query_ball_point(vertices[squeezing], OPPOSITE), strict=True):
        facing = np.array(around)[normals[around] @ normals[i] < -0.5]
        if len(facing):
            other = facing[np.argmin(np.linalg.norm(vertices[facing] - vertices[i], axis=1))]
            motion[i] = 0.5 * (before[i] + before[other]) if yielding[other] else before[other]
