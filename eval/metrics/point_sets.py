"""Distances of vertices and of point sets, as others compute them: to compare with their figures."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from muslin.eval.metrics.checks import checked_points
from muslin.eval.metrics.closest import Surface


@dataclass(frozen=True)
class Chamfer:
    """Distances of two point sets A and B, each point to the nearest of the other set.

    mean_ab = 1/|A| sum_a min_b |a - b|, metres;  square_ab = 1/|A| sum_a min_b |a - b|^2, square metres;
    mean_ba, square_ba the same from B to A; largest = the Hausdorff distance of the sets, metres.

    Papers call all four of the properties below "Chamfer distance".
    """

    mean_ab: float
    mean_ba: float
    square_ab: float
    square_ba: float
    largest: float

    @property
    def sum_squared(self) -> float:
        """square_ab + square_ba, m^2: Fan, Su and Guibas 2017 up to their sums for means; PyTorch3D's
        default."""
        return self.square_ab + self.square_ba

    @property
    def mean_squared(self) -> float:
        """(square_ab + square_ba) / 2, m^2."""
        return 0.5 * (self.square_ab + self.square_ba)

    @property
    def sum_plain(self) -> float:
        """mean_ab + mean_ba, m: point-cloud-utils' `chamfer_distance`."""
        return self.mean_ab + self.mean_ba

    @property
    def mean_plain(self) -> float:
        """(mean_ab + mean_ba) / 2, m: "Chamfer-L1" of Mescheder et al. 2019 (Occupancy Networks)."""
        return 0.5 * (self.mean_ab + self.mean_ba)


def chamfer(points_a: np.ndarray, points_b: np.ndarray) -> Chamfer:
    """Chamfer and Hausdorff distances of two point sets (N, 3), (M, 3), metres.

    Of surfaces they measure the sampling as well: two samples of one surface have a positive distance.
    """
    a = checked_points(points_a, "Chamfer distance, first points").reshape(-1, 3)
    b = checked_points(points_b, "Chamfer distance, second points").reshape(-1, 3)
    ab, ba = cKDTree(b).query(a)[0], cKDTree(a).query(b)[0]
    return Chamfer(
        mean_ab=float(ab.mean()),
        mean_ba=float(ba.mean()),
        square_ab=float(np.square(ab).mean()),
        square_ba=float(np.square(ba).mean()),
        largest=float(max(ab.max(), ba.max())),
    )


def vertex_hausdorff(
    vertices_a: np.ndarray, faces_a: np.ndarray, vertices_b: np.ndarray, faces_b: np.ndarray
) -> tuple[float, float]:
    """max_i d(a_i, B) and max_j d(b_j, A) over vertices alone, exact distances to triangles; metres.

    The larger of the two is `igl.hausdorff`: a lower bound of the Hausdorff distance of the surfaces, which
    misses maxima inside triangles. vertices (V, 3), metres; faces (F, 3); vertices without a face count.
    """
    a, b = Surface(vertices_a, faces_a, "first mesh"), Surface(vertices_b, faces_b, "second mesh")
    return float(b.closest(a.vertices)[0].max()), float(a.closest(b.vertices)[0].max())
