"""Curvature by wavelength: over eigenfunctions of the cloth, and over its panels."""

from __future__ import annotations

from typing import Any, ClassVar, Self

import numpy as np

from muslin.eval.metrics.laplace_beltrami import HarmonicBasis, harmonic_basis
from muslin.eval.metrics.panel_spectrum import (
    PANEL_BAND_EDGES,
    PanelImage,
    panel_energies,
    panel_images,
)
from muslin.eval.metrics.spectrum import (
    BAND_EDGES,
    band_energies,
    curvature_normals,
    spectrum_score,
)
from muslin.eval.read.pairing import Pair
from muslin.eval.score.family import Family, as_json
from muslin.eval.score.frame import PairFrame, UnavailableError
from muslin.garments.mesh import GarmentMesh


class Bands(Family):
    """Energies of both sides and of their difference, band by band; the score is that of their means."""

    figure: ClassVar[str]
    band_edges: ClassVar[tuple[float, ...]]

    def __init__(self, pair: Pair) -> None:
        super().__init__(pair)
        self.energies: dict[str, list[np.ndarray]] = {"prediction": [], "truth": [], "difference": []}

    def merge(self, other: Self) -> None:
        for name, energies in other.energies.items():
            self.energies[name] += energies

    def figures(self) -> dict[str, Any]:
        if not self.energies["truth"]:
            return {self.figure: None}
        means = {name: np.mean(energies, axis=0) for name, energies in self.energies.items() if energies}
        if len(self.energies["difference"]) < len(self.energies["truth"]):
            means.pop("difference", None)
        return {self.figure: as_json(spectrum_score(**means, band_edges=self.band_edges))}


class Spectrum(Bands):
    """Over eigenfunctions of the Laplace-Beltrami operator, in the rest metric of the truth."""

    name, what = "spectrum", "spectra are"
    figure, band_edges = "spectrum", BAND_EDGES

    def __init__(self, pair: Pair) -> None:
        super().__init__(pair)
        self._rest: np.ndarray | None = None
        self._faces: np.ndarray | None = None

    def update(self, frame: PairFrame) -> None:
        faces, garments = frame.true_faces, frame.pair.truth.garments
        if self._rest is None:
            self._faces = faces
            if garments:
                self._rest = _corners(garments[frame.t])
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


class PanelSpectrum(Bands):
    """Over the panels, each side on its own mesh: for all topologies, and shorter waves."""

    name, what = "panel-spectrum", "spectra over panels are"
    figure, band_edges = "panel_spectrum", PANEL_BAND_EDGES

    def __init__(self, pair: Pair) -> None:
        super().__init__(pair)
        self._known: dict[str, tuple[GarmentMesh, HarmonicBasis, tuple[PanelImage, ...]]] = {}

    def update(self, frame: PairFrame) -> None:
        garments = {"prediction": frame.predicted_garment, "truth": frame.true_garment}
        positions = {"prediction": frame.predicted, "truth": frame.true}
        h = {}
        for side, garment in garments.items():
            basis, images = self._of(side, garment)
            h[side] = curvature_normals(basis, positions[side])
            self.energies[side].append(panel_energies(images, h[side]))
        if np.array_equal(garments["prediction"].faces, garments["truth"].faces):
            difference = panel_energies(images, h["prediction"] - h["truth"])
            self.energies["difference"].append(difference)

    def _of(self, side: str, garment: GarmentMesh) -> tuple[HarmonicBasis, tuple[PanelImage, ...]]:
        if side not in self._known:
            corners = _corners(garment)
            images = panel_images(garment.faces, corners, garment.face_panel)
            self._known[side] = garment, harmonic_basis(garment.faces, corners), images
        known, basis, images = self._known[side]
        if known is not garment:
            raise UnavailableError(f"the topology of the {side} changes over time")
        return basis, images


def _corners(garment: GarmentMesh) -> np.ndarray:
    """(F, 3, 2), panel space."""
    return garment.panel_vertices[garment.panel_faces]
