"""How the surfaces are bent: normals, folds, curvature."""

from __future__ import annotations

from typing import Any, Self

import numpy as np

from muslin.eval.metrics.accumulate import ErrorAccumulator
from muslin.eval.metrics.curvature import curvature_distance, mean_curvature
from muslin.eval.metrics.dihedral import dihedral_errors, edge_areas, hinges
from muslin.eval.metrics.normals import normal_distance, normal_errors
from muslin.eval.metrics.vertex import triangle_areas
from muslin.eval.read.pairing import Pair
from muslin.eval.score.family import Family, PairMeans, scaled
from muslin.eval.score.frame import PairFrame, UnavailableError

DEGREES = 180.0 / np.pi


class Normals(Family):
    """Angles between the normals of the truth's faces and of the same points of the prediction.

    Where points do not correspond, between those of nearest points, on average over both surfaces.
    """

    name, what = "normals", "errors of normals are"

    def __init__(self, pair: Pair) -> None:
        super().__init__(pair)
        self.errors = ErrorAccumulator()
        self.nearest = PairMeans()

    def update(self, frame: PairFrame) -> None:
        try:
            seen = frame.seen
        except UnavailableError:
            sides = (frame.predicted, frame.predicted_faces, frame.true, frame.true_faces)
            self.nearest.add(distance=normal_distance(*sides).mean)
            return
        areas = triangle_areas(frame.true, frame.true_faces)
        self.errors.update(normal_errors(seen, frame.true, frame.true_faces), areas)

    def merge(self, other: Self) -> None:
        self.errors.merge(other.errors)
        self.nearest.merge(other.nearest)

    def figures(self) -> dict[str, Any]:
        nearest = self.nearest.mean("distance")
        return {
            "normal_error_deg": scaled(self.errors.weighted_result(), DEGREES),
            "normal_distance_deg": None if nearest is None else DEGREES * nearest,
        }

    def frames(self) -> dict[str, list[Any]]:
        return {"normal_mean": self.errors.weighted_means(DEGREES)}


class Folds(Family):
    """Errors of the dihedral angles at the truth's edges."""

    name, what = "folds", "errors of dihedral angles are"

    def __init__(self, pair: Pair) -> None:
        super().__init__(pair)
        self.errors = ErrorAccumulator()
        self._hinges: tuple[np.ndarray, np.ndarray] | None = None

    def update(self, frame: PairFrame) -> None:
        faces = frame.true_faces
        if self._hinges is None or self._hinges[0] is not faces:
            self._hinges = faces, hinges(faces)
        edges = self._hinges[1]
        self.errors.update(
            dihedral_errors(frame.seen, frame.true, edges), edge_areas(frame.true, edges, faces)
        )

    def merge(self, other: Self) -> None:
        self.errors.merge(other.errors)

    def figures(self) -> dict[str, Any]:
        return {"dihedral_error_deg": scaled(self.errors.weighted_result(), DEGREES)}


class Curvature(Family):
    """Distributions of mean curvature, each side on its own mesh."""

    name, what = "curvature", "distances of curvature are"

    def __init__(self, pair: Pair) -> None:
        super().__init__(pair)
        self.means = PairMeans()

    def update(self, frame: PairFrame) -> None:
        prediction = mean_curvature(frame.predicted, frame.predicted_faces)
        truth = mean_curvature(frame.true, frame.true_faces)
        self.means.add(
            distance=curvature_distance(prediction, truth), prediction=prediction.rms, truth=truth.rms
        )

    def merge(self, other: Self) -> None:
        self.means.merge(other.means)

    def figures(self) -> dict[str, Any]:
        distance = self.means.mean("distance")
        return {
            "curvature_1_m": None
            if distance is None
            else {
                "distance": distance,
                "prediction_rms": self.means.mean("prediction"),
                "truth_rms": self.means.mean("truth"),
            }
        }

    def frames(self) -> dict[str, list[Any]]:
        return {"curvature_distance": self.means.values.get("distance", [])}
