"""What of the cloth is inside the body, and what crosses."""

from __future__ import annotations

from typing import Any, Self

import numpy as np

from muslin.eval.metrics.contact import body_contact, self_contact
from muslin.eval.metrics.contact_summary import (
    BodyContactSummary,
    ContactAccumulator,
    SelfContactSummary,
)
from muslin.eval.metrics.penetration import PSEUDONORMAL
from muslin.eval.metrics.penetration_definitions import penetration_definitions
from muslin.eval.read.pairing import Pair
from muslin.eval.score.family import MM, Family, PairMeans
from muslin.eval.score.frame import PairFrame, UnavailableError

LITRES = 1000.0
NO_BODY = "neither side comes with a body"
SOME_FRAMES = "penetration by other definitions of some frames of a sequence only, evenly spread"
OPEN_BODY = (
    "the body is not closed, so what is inside is told by the direction of its nearest normal, and areas by "
    "samples"
)


class BothSides(Family):
    """Contacts of the prediction and of the truth."""

    def __init__(self, pair: Pair) -> None:
        super().__init__(pair)
        self.sides = {"prediction": ContactAccumulator(), "truth": ContactAccumulator()}

    def merge(self, other: Self) -> None:
        for side, kept in self.sides.items():
            kept.merge(other.sides[side])


class BodyContact(BothSides):
    """Both sides against one body: that of the truth, if it has one."""

    name, what = "body-contact", "penetration and intersections with the body are"

    def update(self, frame: PairFrame) -> None:
        if frame.body is None or frame.pair.body is None:
            raise UnavailableError(NO_BODY)
        masked = _masked(frame)
        cloths = {
            "prediction": (frame.predicted, frame.predicted_faces),
            "truth": (frame.true, frame.true_faces),
        }
        for side, cloth in cloths.items():
            found = body_contact(*cloth, frame.body, frame.pair.body.faces, masked)
            self.sides[side].update(body=found)
            if found.method == PSEUDONORMAL and OPEN_BODY not in self.notes:
                self.notes.append(OPEN_BODY)

    def figures(self) -> dict[str, Any]:
        results = {side: kept.body_result() for side, kept in self.sides.items()}
        return {
            "penetration": _penetration(results["prediction"]),
            "truth_penetration": _penetration(results["truth"]),
            "body_intersections": _intersections(results["prediction"]),
            "truth_body_intersections": _intersections(results["truth"]),
        }

    def frames(self) -> dict[str, list[Any]]:
        frames = self.sides["prediction"].body
        return {
            "penetration_ratio": [frame.inside / frame.vertices for frame in frames],
            "body_pairs": [frame.pairs for frame in frames],
        }


class SelfContact(BothSides):
    """Each side against itself."""

    name, what = "self-contact", "intersections of the cloth with itself are"

    def update(self, frame: PairFrame) -> None:
        self.sides["prediction"].update(own=self_contact(frame.predicted, frame.predicted_faces))
        self.sides["truth"].update(own=self_contact(frame.true, frame.true_faces))

    def figures(self) -> dict[str, Any]:
        return {
            "self_intersections": _intersections(self.sides["prediction"].self_result()),
            "truth_self_intersections": _intersections(self.sides["truth"].self_result()),
        }

    def frames(self) -> dict[str, list[Any]]:
        return {"self_pairs": [frame.pairs for frame in self.sides["prediction"].own]}


class Definitions(Family):
    """Penetration of the prediction as others define it, for comparison with papers; of the chosen frames."""

    name, what = "definitions", "other definitions of penetration are"

    def __init__(self, pair: Pair) -> None:
        super().__init__(pair)
        self.means = PairMeans()

    def update(self, frame: PairFrame) -> None:
        if frame.body is None or frame.pair.body is None:
            raise UnavailableError(NO_BODY)
        if not frame.chosen:
            self.notes = [SOME_FRAMES]
            return
        cloth, body = (frame.predicted, frame.predicted_faces), (frame.body, frame.pair.body.faces)
        self.means.add(**penetration_definitions(*cloth, *body).to_dict())

    def merge(self, other: Self) -> None:
        self.means.merge(other.means)

    def figures(self) -> dict[str, Any]:
        found = {name: self.means.mean(name) for name in self.means.values}
        return {"penetration_definitions": found or None}


def _masked(frame: PairFrame) -> np.ndarray | None:
    """Faces of the body between parts of it that overlap, by the truth's certificate."""
    sample = frame.pair.truth.sample
    return None if sample is None else sample.masked(frame.t)


def _penetration(found: BodyContactSummary | None) -> dict[str, Any] | None:
    if found is None:
        return None
    return {
        "ratio": found.vertex_ratio,
        "area_ratio": found.area_ratio,
        "area_ratio_uncertain": found.area_uncertain,
        "depth_mean_mm": MM * found.depth_mean,
        "depth_max_mm": MM * found.depth_max,
        "surface_depth_max_mm": MM * found.surface_depth,
        "volume_mean_l": LITRES * found.volume_mean,
        "volume_max_l": LITRES * found.volume_max,
        "method": found.method,
    }


def _intersections(found: BodyContactSummary | SelfContactSummary | None) -> dict[str, Any] | None:
    if found is None:
        return None
    return {
        "frames": found.touched,
        "pairs_mean": found.pairs_mean,
        "pairs_max": found.pairs_max,
        "contour_mean_m": found.contour_mean,
        "contour_max_m": found.contour_max,
        "coplanar": found.coplanar,
    }
