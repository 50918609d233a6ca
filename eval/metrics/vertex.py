"""Distances between corresponding vertices, and the statistics that every metric reports."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from muslin.garments.errors import InputError


@dataclass(frozen=True)
class Statistics:
    """Mean, root mean square, median, 95th percentile and maximum, in the unit of the values."""

    mean: float
    rms: float
    median: float
    p95: float
    max: float

    def scaled(self, factor: float) -> dict[str, float]:
        """The five figures times a factor (1000 for metres to millimetres), by name."""
        return {name: getattr(self, name) * factor for name in ("mean", "rms", "median", "p95", "max")}


def vertex_errors(prediction: np.ndarray, truth: np.ndarray) -> np.ndarray:
    """e_i = |x_i - y_i|: Euclidean distance of corresponding vertices.

    prediction, truth   (..., V, 3), metres
    returns             (..., V), metres

    Raises InputError if the shapes differ or a value is not finite.
    """
    if prediction.shape != truth.shape or prediction.shape[-1] != 3:
        raise InputError(
            "vertex errors need two arrays of one shape (..., V, 3); "
            f"got {prediction.shape} and {truth.shape}; "
            "compare meshes of different topology by surface distance"
        )
    errors = np.linalg.norm(prediction.astype(np.float64) - truth.astype(np.float64), axis=-1)
    if not np.isfinite(errors).all():
        raise InputError("vertex errors: NaN or infinity in the positions; every coordinate must be finite")
    return errors


def vertex_areas(vertices: np.ndarray, faces: np.ndarray) -> np.ndarray:
    """Barycentric area of each vertex: A_i = 1/3 sum of the areas of the triangles around it.

    vertices (V, 3), metres; faces (F, 3); returns (V,), square metres, whose sum is the area of the mesh.
    """
    areas = triangle_areas(vertices, faces)
    return np.bincount(faces.ravel(), weights=np.repeat(areas / 3.0, 3), minlength=len(vertices))


def triangle_areas(vertices: np.ndarray, faces: np.ndarray) -> np.ndarray:
    """A_f = |(b - a) x (c - a)| / 2 for each face; (F,), square metres."""
    a, b, c = (vertices[faces[:, k]] for k in range(3))
    return 0.5 * np.linalg.norm(np.cross(b - a, c - a), axis=-1)


def statistics(values: np.ndarray, weights: np.ndarray | None = None) -> Statistics:
    """Weighted statistics of non-negative values.

    mean = sum w e / sum w,  rms = sqrt(sum w e^2 / sum w),  quantile q = the smallest e with at least the
    share q of the weight at or below it (the inverse of the empirical distribution, so always a value).

    values    any shape
    weights   broadcastable to values, non-negative; None counts every value alike. With `vertex_areas` the
              figures no longer depend on where the mesh has many vertices.

    Raises InputError if there is no value, or no weight.
    """
    if values.size == 0:
        raise InputError("statistics of no values: give at least one vertex and one frame")
    flat = np.asarray(values, dtype=np.float64).ravel()
    w = None if weights is None else np.broadcast_to(weights, values.shape).ravel().astype(np.float64)
    if w is not None and (not np.isfinite(w).all() or (w < 0).any() or w.sum() <= 0):
        raise InputError("statistics: weights must be finite, non-negative and not all zero")
    median, p95 = np.quantile(flat, [0.5, 0.95], method="inverted_cdf", weights=w)
    return Statistics(
        mean=float(np.average(flat, weights=w)),
        rms=float(np.sqrt(np.average(flat**2, weights=w))),
        median=float(median),
        p95=float(p95),
        max=float(flat.max()),
    )
