"""How the surfaces are bent: normals, folds, curvature and its spectrum."""

from __future__ import annotations

from typing import Any, Self

import numpy as np

from muslin.eval.metrics.accumulate import ErrorAccumulator
from muslin.eval.metrics.curvature import curvature_distance, mean_curvature
from muslin.eval.metrics.dihedral import dihedral_errors, edge_areas, hinges
from muslin.eval.metrics.laplace_beltrami import harmonic_basis
from muslin.eval.metrics.normals import normal_errors
from muslin.eval.metrics.spectrum import band_energies, curvature_normals, spectrum_score
from muslin.eval.metrics.vertex import triangle_areas
from muslin.eval.read.pairing import Pair
from muslin.eval.score.family import Family, PairMeans, as_json, scaled
from muslin.eval.score.frame import PairFrame, UnavailableError

DEGREES = 180.0 / np.pi


class Normals(Family):
    """Angles between the normals of the truth's faces and of the same points of the prediction."""

    name, what = "normals", "errors of normals are"

    def __init__(self, pair: Pair) -> None:
        super().__init__(pair)
        self.errors = ErrorAccumulator()

    def update(self, frame: PairFrame) -> None:
        areas = triangle_areas(frame.true, frame.true_faces)
        self.errors.update(normal_errors(frame.seen, frame.true, frame.true_faces), areas)

    def merge(self, other: Self) -> None:
        self.errors.merge(other.errors)

    def figures(self) -> dict[str, Any]:
        return {"normal_error_deg": scaled(self.errors.weighted_result(), DEGREES)}

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


class Spectrum(Family):
    """Curvature by wavelength, in the rest metric of the truth."""

    name, what = "spectrum", "spectra are"

    def __init__(self, pair: Pair) -> None:
        super().__init__(pair)
        self.energies: dict[str, list[np.ndarray]] = {"prediction": [], "truth": [], "difference": []}
        self._rest: np.ndarray | None = None
        self._faces: np.ndarray | None = None

    def update(self, frame: PairFrame) -> None:
        faces, garments = frame.true_faces, frame.pair.truth.garments
        if self._rest is None:
            self._faces = faces
            if garments:
                self._rest = garments[frame.t].panel_vertices[garments[frame.t].panel_faces]
            else:
                self._rest = frame.true[faces]
                self.notes.append(
                    "no panels of the truth are known, so spectra are in the metric of its first frame"
                )
        elif faces is not self._faces:
            raise UnavailableError("the topology of the truth changes over time")
        basis = harmonic_basis(faces, self._rest)
        h = curvature_normals(basis, np.stack([frame.seen, frame.true]))
        energies = band_energies(basis, np.stack([h[0], h[1], h[0] - h[1]]))
        for name, energy in zip(self.energies, energies, strict=True):
            self.energies[name].append(energy)

    def merge(self, other: Self) -> None:
        for name, energies in other.energies.items():
            self.energies[name] += energies

    def figures(self) -> dict[str, Any]:
        if not self.energies["truth"]:
            return {"spectrum": None}
        means = {name: np.mean(energies, axis=0) for name, energies in self.energies.items()}
        return {"spectrum": as_json(spectrum_score(**means))}
