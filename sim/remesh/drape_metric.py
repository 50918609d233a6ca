"""Sizing fields for triangulating from the start: smooth enough for good triangles, of a given number."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from muslin.garments.errors import InputError
from muslin.garments.mesh import GarmentMesh
from muslin.sim.remesh.gradation import limit_gradation
from muslin.sim.remesh.metric import triangles_asked
from muslin.sim.remesh.settings import RemeshSettings
from muslin.sim.remesh.sizing import sizing_field

Array = NDArray[np.float64]


def drape_metric(
    mesh: GarmentMesh, positions: Array, settings: RemeshSettings, mean_area: float | None = None
) -> Array:
    """(P, 2, 2) metric at panel vertices, 1/m^2, for `remesh`: what the drape of `positions` (V, 3), metres,
    asks for by curvature and compression (`sizing_field`), its sizes growing gradually (`limit_gradation`).

    With `mean_area`, m^2, the whole is made finer or coarser by one factor so that triangles have it in the
    mean (`with_mean_area`); the bounds size_min and size_max of `settings` then hold up to that factor.
    """
    metric = limit_gradation(mesh, sizing_field(mesh, positions, settings))
    return metric if mean_area is None else with_mean_area(mesh, metric, mean_area)


def with_mean_area(mesh: GarmentMesh, metric: Array, area: float) -> Array:
    """c M with the c that makes triangles of `area` m^2 in the mean:

        c N = sum_f A_f / area,   N = 4 / sqrt(3) sum_f A_f sqrt(det M_f),

    N how many equilateral triangles of edges of size 1 there are in M (P, 2, 2). InputError unless positive.
    """
    if not (np.isfinite(area) and area > 0.0):
        raise InputError(f"target area = {area:g} m^2: must be positive; give a mean triangle area in m^2")
    count = float(triangles_asked(mesh, metric).sum())
    return metric * (float(mesh.face_areas.sum()) / area / count)
