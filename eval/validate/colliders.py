"""Colliders of the cases, those of scenes: vertices (N, 3), metres, and faces (M, 3) counter-clockwise from
outside."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from muslin.sim.world.colliders import Colliders
from muslin.sim.world.tables import Plane, Sphere

Surface = tuple[NDArray[np.float64], NDArray[np.int32]]


def slope(angle: float, side: float) -> Surface:
    """A square of two triangles through the origin, falling towards +x by `angle` radians."""
    return _alone(Plane(shape="plane", size=side, rotation=(0.0, 0.0, -angle)))


def sphere(radius: float, subdivisions: int) -> Surface:
    """An icosphere around the origin."""
    return _alone(Sphere(shape="sphere", radius=radius, subdivisions=subdivisions))


def _alone(table: Plane | Sphere) -> Surface:
    colliders = Colliders([table])
    return colliders.at(0.0), colliders.faces
