"""Distances between the surfaces, whatever their triangles."""

from __future__ import annotations

from typing import Any, Self

import numpy as np

from muslin.eval.metrics.surface_pair import compare_surfaces
from muslin.eval.read.pairing import Pair
from muslin.eval.score.family import MM, Family
from muslin.eval.score.frame import PairFrame

FIGURES = (
    "hausdorff_mm",
    "hausdorff_upper_mm",
    "hausdorff_mean_mm",
    "mean_surface_distance_mm",
    "rms_surface_distance_mm",
)
SOME_FRAMES = "surface distances of some frames of a sequence only, evenly spread (--surface-frames)"


class SurfaceDistances(Family):
    """Hausdorff distance with its bounds, mean and rms distance; of the chosen frames."""

    name, what = "surface", "surface distances are"

    def __init__(self, pair: Pair) -> None:
        super().__init__(pair)
        self.chosen: list[int] = []
        self.lower: list[float] = []
        self.upper: list[float] = []
        self.mean: list[float] = []
        self.rms: list[float] = []

    def update(self, frame: PairFrame) -> None:
        if not frame.chosen:
            self.notes = [SOME_FRAMES]
            return
        sides = (frame.predicted, frame.predicted_faces, frame.true, frame.true_faces)
        found = compare_surfaces(*sides)
        bounds, distance = found.hausdorff, found.distance
        self.chosen.append(frame.t)
        self.lower.append(bounds.lower)
        self.upper.append(bounds.upper)
        self.mean.append(distance.mean)
        self.rms.append(distance.rms)

    def merge(self, other: Self) -> None:
        for name in ("lower", "upper", "mean", "rms"):
            getattr(self, name).extend(getattr(other, name))

    def figures(self) -> dict[str, Any]:
        if not self.lower:
            return dict.fromkeys(FIGURES)
        return {
            "hausdorff_mm": MM * max(self.lower),
            "hausdorff_upper_mm": MM * max(self.upper),
            "hausdorff_mean_mm": MM * float(np.mean(self.lower)),
            "mean_surface_distance_mm": MM * float(np.mean(self.mean)),
            "rms_surface_distance_mm": MM * float(np.sqrt(np.mean(np.square(self.rms)))),
        }

    def frames(self) -> dict[str, list[Any]]:
        return {
            "surface_frames": list(self.chosen),
            "hausdorff": [MM * value for value in self.lower],
            "surface": [MM * value for value in self.mean],
        }
