"""Whether a prediction is cloth: its strain, lengths, areas and energy."""

from __future__ import annotations

from typing import Any, Self

import numpy as np

from muslin.eval.fabric_energy import Energy, FabricEnergy, setting_of
from muslin.eval.metrics.accumulate import ErrorAccumulator
from muslin.eval.metrics.change import area_changes, edge_length_changes, side_weights
from muslin.eval.metrics.checks import corner_areas
from muslin.eval.metrics.strain import green_strain, percentiles
from muslin.eval.metrics.vertex import triangle_areas
from muslin.eval.read.pairing import Pair
from muslin.eval.score.family import Family, PairMeans, as_json, scaled
from muslin.eval.score.frame import PairFrame, UnavailableError
from muslin.garments.errors import InputError
from muslin.garments.mesh import GarmentMesh

STRAINS = ("major", "minor", "warp", "weft", "shear")


class Strain(Family):
    """Green strain of both sides against their own panels, by area at rest."""

    name, what = "strain", "strains are"

    def __init__(self, pair: Pair) -> None:
        super().__init__(pair)
        self.values: dict[str, dict[str, list[np.ndarray]]] = {
            side: {name: [] for name in (*STRAINS, "areas")} for side in ("prediction", "truth")
        }

    def update(self, frame: PairFrame) -> None:
        sides = {
            "prediction": (frame.predicted, frame.predicted_garment),
            "truth": (frame.true, frame.true_garment),
        }
        for side, (x, garment) in sides.items():
            corners = garment.panel_vertices[garment.panel_faces]
            strain, kept = green_strain(x, garment.faces, corners), self.values[side]
            for name in STRAINS:
                kept[name].append(getattr(strain, name).astype(np.float32))
            kept["areas"].append(corner_areas(corners).astype(np.float32))

    def merge(self, other: Self) -> None:
        for side, kept in self.values.items():
            for name, values in kept.items():
                values += other.values[side][name]

    def figures(self) -> dict[str, Any]:
        return {"strain": {side: self._percentiles(side) for side in self.values} if self._any() else None}

    def frames(self) -> dict[str, list[Any]]:
        kept = self.values["prediction"]
        return {"strain_max": [float(values.max()) for values in kept["major"]]}

    def _any(self) -> bool:
        return bool(self.values["truth"]["areas"])

    def _percentiles(self, side: str) -> dict[str, Any]:
        kept = self.values[side]
        areas = np.concatenate(kept["areas"])
        return {name: as_json(percentiles(np.concatenate(kept[name]), areas)) for name in STRAINS}


class Change(Family):
    """Lengths of edges and areas of faces against the truth's, as shares of them, by the truth's area."""

    name, what = "change", "changes of lengths and areas are"

    def __init__(self, pair: Pair) -> None:
        super().__init__(pair)
        self.edges, self.areas = ErrorAccumulator(), ErrorAccumulator()

    def update(self, frame: PairFrame) -> None:
        areas = triangle_areas(frame.true, frame.true_faces)
        edges = np.abs(edge_length_changes(frame.seen, frame.true_faces, frame.true))
        self.edges.update(edges.ravel(), side_weights(areas).ravel())
        self.areas.update(np.abs(area_changes(frame.seen, frame.true_faces, frame.true)), areas)

    def merge(self, other: Self) -> None:
        self.edges.merge(other.edges)
        self.areas.merge(other.areas)

    def figures(self) -> dict[str, Any]:
        return {
            "edge_length_error": scaled(self.edges.weighted_result()),
            "area_error": scaled(self.areas.weighted_result()),
        }


class FabricEnergies(Family):
    """Elastic and gravitational energy of both sides in the truth's fabric, means over frames."""

    name, what = "energy", "energies are"

    def __init__(self, pair: Pair) -> None:
        super().__init__(pair)
        self.means = PairMeans()
        self._sample = pair.truth.sample
        self._known: dict[int, tuple[GarmentMesh, FabricEnergy]] = {}

    def update(self, frame: PairFrame) -> None:
        sides = {
            "prediction": self._of(frame.predicted_garment).energy(frame.predicted),
            "truth": self._of(frame.true_garment).energy(frame.true),
        }
        sides["excess"] = sides["prediction"] - sides["truth"]
        for side, energy in sides.items():
            self.means.add(**{f"{side}.{name}": value for name, value in _parts(energy).items()})

    def merge(self, other: Self) -> None:
        self.means.merge(other.means)

    def figures(self) -> dict[str, Any]:
        if not self.means.values:
            return {"energy_j": None}
        found: dict[str, dict[str, float | None]] = {}
        for name in self.means.values:
            side, part = name.split(".")
            found.setdefault(side, {})[part] = self.means.mean(name)
        return {"energy_j": found}

    def frames(self) -> dict[str, list[Any]]:
        return {"energy_excess": self.means.values.get("excess.total", [])}

    def _of(self, mesh: GarmentMesh) -> FabricEnergy:
        if id(mesh) not in self._known:
            if self._sample is None:
                raise UnavailableError("the truth is no sample, so its fabric is not known")
            try:
                self._known[id(mesh)] = mesh, FabricEnergy(mesh, *setting_of(self._sample))
            except InputError as error:
                raise UnavailableError(str(error)) from error
        return self._known[id(mesh)][1]


def _parts(energy: Energy) -> dict[str, float]:
    return {
        "stretch": energy.stretch,
        "bending": energy.bending,
        "gravity": energy.gravity,
        "total": energy.total,
    }
