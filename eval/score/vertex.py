"""Distances between corresponding points."""

from __future__ import annotations

from typing import Any, Self

from muslin.eval.metrics.accumulate import ErrorAccumulator
from muslin.eval.metrics.vertex import vertex_areas, vertex_errors
from muslin.eval.read.pairing import Pair
from muslin.eval.score.family import MM, Family, scaled
from muslin.eval.score.frame import PairFrame


class Vertex(Family):
    """Vertex errors, plain and by area of the truth."""

    name, what = "vertex", "vertex errors are"

    def __init__(self, pair: Pair) -> None:
        super().__init__(pair)
        self.errors = ErrorAccumulator()

    def update(self, frame: PairFrame) -> None:
        areas = vertex_areas(frame.true, frame.true_faces)
        self.errors.update(vertex_errors(frame.seen, frame.true), areas)

    def merge(self, other: Self) -> None:
        self.errors.merge(other.errors)

    def figures(self) -> dict[str, Any]:
        return {
            "vertex_error_mm": scaled(self.errors.result(), MM),
            "vertex_error_area_weighted_mm": scaled(self.errors.weighted_result(), MM),
        }

    def frames(self) -> dict[str, list[Any]]:
        return {
            "vertex_mean": [MM * float(e.mean()) for e in self.errors.errors],
            "vertex_max": [MM * float(e.max()) for e in self.errors.errors],
        }
