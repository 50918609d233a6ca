"""Errors of velocity, acceleration and jerk, and jitter."""

from __future__ import annotations

from typing import Any, Self

import numpy as np

from muslin.eval.metrics.accumulate import ErrorAccumulator
from muslin.eval.metrics.motion import derivative_errors, jerk_sizes, jitter_of_means
from muslin.eval.read.pairing import Pair
from muslin.eval.score.family import MM, Family, PairMeans, as_json, scaled
from muslin.eval.score.frame import PairFrame, UnavailableError

ORDERS = (1, 2, 3)
ONE_FRAME = "one frame only"


class Motion(Family):
    """Derivatives of the truth's vertices at the last of the frames that they are taken from.

    A derivative of order n exists from frame n on. Jitter counts every vertex alike.
    """

    name, what = "motion", "errors of velocity, acceleration and jerk are"

    def __init__(self, pair: Pair) -> None:
        super().__init__(pair)
        self.errors = {order: ErrorAccumulator() for order in ORDERS}
        self.jerks = PairMeans()

    def update(self, frame: PairFrame) -> None:
        if frame.pair.truth.num_frames < 2:
            raise UnavailableError(ONE_FRAME)
        predicted, true = frame.window()
        for order in ORDERS:
            if order >= len(true):
                return
            last = slice(-order - 1, None)
            errors = derivative_errors(predicted[last], true[last], frame.fps, order)
            self.errors[order].update(errors[0])
        sides = {"prediction": predicted, "truth": true}
        self.jerks.add(**{side: float(np.mean(jerk_sizes(x, frame.fps))) for side, x in sides.items()})

    def merge(self, other: Self) -> None:
        for order in ORDERS:
            self.errors[order].merge(other.errors[order])
        self.jerks.merge(other.jerks)

    def figures(self) -> dict[str, Any]:
        means = self.jerks.mean("prediction"), self.jerks.mean("truth")
        return {
            "velocity_error_mm_s": scaled(self.errors[1].result(), MM),
            "acceleration_error_m_s2": scaled(self.errors[2].result()),
            "jerk_error_m_s3": scaled(self.errors[3].result()),
            "jitter_m_s3": None
            if means[0] is None or means[1] is None
            else as_json(jitter_of_means(means[0], means[1])),
        }

    def frames(self) -> dict[str, list[Any]]:
        return {
            "velocity_mean": [MM * float(e.mean()) for e in self.errors[1].errors],
            "acceleration_mean": [float(e.mean()) for e in self.errors[2].errors],
        }
