"""One frame of a prediction beside the same frame of the truth."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterator, Sequence
from functools import cached_property

import numpy as np

from muslin.eval.material_points import MaterialPoints
from muslin.eval.read.pairing import Pair
from muslin.garments.errors import InputError
from muslin.garments.mesh import GarmentMesh

MOST_EARLIER = 3
"""Frames before this one that are kept: jerk needs four in all."""


class UnavailableError(Exception):
    """A pair lacks what a metric needs; says what."""


class PairFrame:
    """Frame `t` of a pair: what its metrics are computed from.

    predicted, true               (V, 3) positions of both sides, metres
    predicted_faces, true_faces   (F, 3)
    chosen                        whether it is one of the frames that get costly figures
    """

    def __init__(
        self, pair: Pair, t: int, points: MaterialPoints, earlier: Sequence[PairFrame], chosen: bool
    ) -> None:
        """earlier   the frames just before this one, at most `MOST_EARLIER`"""
        self.pair, self.t, self.points, self._earlier, self.chosen = pair, t, points, tuple(earlier), chosen
        self.predicted, self.true = pair.prediction.positions[t], pair.truth.positions[t]
        self.predicted_faces, self.true_faces = pair.prediction.faces[t], pair.truth.faces[t]

    @property
    def fps(self) -> float:
        """Frames per second. UnavailableError if not known."""
        if self.pair.truth.fps is None:
            raise UnavailableError("the frame rate is not known; give it (--fps)")
        return self.pair.truth.fps

    @cached_property
    def seen(self) -> np.ndarray:
        """(V, 3) where the prediction has the points that the truth's vertices are, metres.

        UnavailableError if the points do not correspond.
        """
        return self._carried(self)[0]

    @cached_property
    def body(self) -> np.ndarray | None:
        """(N, 3) of what the cloth lies on, metres; None if not known."""
        return None if self.pair.body is None else self.pair.body.vertices(self.t)

    @property
    def predicted_garment(self) -> GarmentMesh:
        """The prediction's mesh with its panels. UnavailableError if not known."""
        return _garment(self.pair.prediction.garments, self.t, "the prediction")

    @property
    def true_garment(self) -> GarmentMesh:
        """The truth's mesh with its panels. UnavailableError if not known."""
        return _garment(self.pair.truth.garments, self.t, "the truth")

    def window(self) -> tuple[np.ndarray, np.ndarray]:
        """The last frames, this one included, of both sides at the truth's vertices of this frame.

        (n, V, 3) each, metres, n at most `MOST_EARLIER` + 1. UnavailableError as for `seen`.
        """
        predicted, true = zip(*(self._carried(frame) for frame in (*self._earlier, self)), strict=True)
        return np.stack(predicted), np.stack(true)

    def forget(self) -> None:
        """Let the earlier frames go."""
        self._earlier = ()

    def _carried(self, frame: PairFrame) -> tuple[np.ndarray, np.ndarray]:
        """Both sides of a frame at the truth's vertices of this one."""
        truth, target = self.pair.truth, (self.pair.truth, self.t, len(self.true))
        try:
            predicted = self.points.carried(frame.predicted, self.pair.prediction, frame.t, *target)
            true = frame.true if frame is self else self.points.carried(frame.true, truth, frame.t, *target)
        except InputError as error:
            raise UnavailableError(str(error)) from error
        return predicted, true


def frames_of(pair: Pair, points: MaterialPoints, most_chosen: int) -> Iterator[PairFrame]:
    """All frames of a pair in order, each read once; at most `most_chosen` are chosen, evenly spread."""
    count = pair.truth.num_frames
    chosen = set(np.linspace(0, count - 1, min(count, most_chosen)).round().astype(int).tolist())
    last: deque[PairFrame] = deque(maxlen=MOST_EARLIER)
    for t in range(count):
        frame = PairFrame(pair, t, points, last, t in chosen)
        yield frame
        frame.forget()
        last.append(frame)


def _garment(garments: Sequence[GarmentMesh], t: int, whose: str) -> GarmentMesh:
    if not garments:
        raise UnavailableError(f"no panels of {whose} are known")
    return garments[t]
