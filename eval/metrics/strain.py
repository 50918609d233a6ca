"""Green strain of cloth against its panels, and the percentiles that tell stretched from compressed."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from muslin.eval.metrics.checks import check_faces, checked_corners, checked_points
from muslin.garments.errors import InputError

QUANTILES = {"p1": 0.01, "p5": 0.05, "p50": 0.5, "p95": 0.95, "p99": 0.99}


@dataclass(frozen=True, eq=False)
class GreenStrain:
    """Strain of each face, no unit; (..., F) each.

    warp, weft, shear   E11, E22 and E12 in the directions of the threads
    major, minor        the principal strains, major >= minor
    """

    warp: np.ndarray
    weft: np.ndarray
    shear: np.ndarray
    major: np.ndarray
    minor: np.ndarray


@dataclass(frozen=True)
class Percentiles:
    """Least, 1st, 5th, 50th, 95th and 99th percentile and largest of signed values, in their unit."""

    min: float
    p1: float
    p5: float
    p50: float
    p95: float
    p99: float
    max: float


def green_strain(positions: np.ndarray, faces: np.ndarray, panels: np.ndarray) -> GreenStrain:
    """Green strain of each triangle, from its panel to where it is.

        E = (F^T F - I) / 2,   F = dx/du,   u = (warp, weft) = (y, x) of panel space

    E = (s^2 - 1) / 2 for threads stretched by s: 0.05 is 4.9% longer, -0.5 is length zero; E12 = (s1 s2 / 2)
    cos g of threads at the angle g. Principal strains: eigenvalues of E, (E11 + E22) / 2 +- sqrt((E11 -
    E22)^2 / 4 + E12^2). Rigid motions change nothing. What the stretching energy of `muslin.sim` is a
    function of.

    positions   (..., V, 3), metres
    faces       (F, 3), sewn
    panels      (F, 3, 2), corners of the faces in panel space, metres, the warp along +y:
                `panel_vertices[panel_faces]` of a garment

    Raises InputError for arrays that do not match, are not finite, or panels with a triangle without area.
    """
    x = checked_points(positions, "Green strain")
    check_faces(faces, x.shape[-2], "Green strain")
    rest = checked_corners(panels, len(faces), "Green strain")
    if rest.shape[2] != 2:
        raise InputError(
            "Green strain: the panels must be given in panel space, (F, 3, 2), with warp and weft"
        )
    gram = _gram(x, faces, _inverse_rest(rest))
    warp, weft, shear = 0.5 * (gram[0] - 1.0), 0.5 * (gram[1] - 1.0), 0.5 * gram[2]
    mean, half = 0.5 * (warp + weft), 0.5 * (warp - weft)
    radius = np.hypot(half, shear)
    return GreenStrain(warp, weft, shear, mean + radius, mean - radius)


def percentiles(values: np.ndarray, weights: np.ndarray | None = None) -> Percentiles:
    """Percentiles of signed values, by weight: the smallest value with at least that share at or below it.

    values    (..., F), such as a part of a `GreenStrain`
    weights   broadcastable to values, such as the areas of the faces at rest; None counts all alike

    Raises InputError if there is no value, one is not finite, or there is no weight.
    """
    if values.size == 0 or not np.isfinite(values).all():
        raise InputError("percentiles: give at least one value, and only finite ones")
    w = None if weights is None else np.broadcast_to(weights, values.shape).ravel().astype(np.float64)
    if w is not None and (not np.isfinite(w).all() or (w < 0.0).any() or w.sum() <= 0.0):
        raise InputError("percentiles: weights must be finite, not negative and not all zero")
    flat = np.asarray(values, dtype=np.float64).ravel()
    found = np.quantile(flat, list(QUANTILES.values()), method="inverted_cdf", weights=w)
    named = dict(zip(QUANTILES, found.tolist(), strict=True))
    return Percentiles(min=float(flat.min()), **named, max=float(flat.max()))


def _inverse_rest(panels: np.ndarray) -> np.ndarray:
    """(F, 2, 2) inverse of the edges (b - a, c - a) in (warp, weft), 1/m."""
    u = panels[..., ::-1]
    return np.linalg.inv(np.stack([u[:, 1] - u[:, 0], u[:, 2] - u[:, 0]], axis=2))


def _gram(x: np.ndarray, faces: np.ndarray, inverse: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """F1 . F1, F2 . F2 and F1 . F2 of the deformation gradient; (..., F) each."""
    a = x[..., faces[:, 0], :]
    p, q = x[..., faces[:, 1], :] - a, x[..., faces[:, 2], :] - a
    pp, qq, pq = (np.einsum("...i,...i", s, t) for s, t in ((p, p), (q, q), (p, q)))
    first, second = inverse[:, 0, :], inverse[:, 1, :]

    def product(i: int, j: int) -> np.ndarray:
        mixed = first[:, i] * second[:, j] + second[:, i] * first[:, j]
        return first[:, i] * first[:, j] * pp + second[:, i] * second[:, j] * qq + mixed * pq

    return product(0, 0), product(1, 1), product(0, 1)
