"""A prediction beside its truth: faces that one of them lacks, units, and the body to measure against."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from muslin.eval.read.check import check_track
from muslin.eval.read.track import MovingSurface, Track
from muslin.eval.read.units import check_scales, check_size
from muslin.garments.errors import InputError


@dataclass(frozen=True, eq=False)
class Pair:
    """Two tracks that can be scored, checked.

    body    what both are measured against: the truth's body, or the prediction's if the truth has none
    notes   what a reader of the scores has to know
    """

    prediction: Track
    truth: Track
    body: MovingSurface | None
    notes: tuple[str, ...]


def paired(prediction: Track, truth: Track) -> Pair:
    """Complete and check the two sides of a comparison.

    A side without faces takes the other's, if the vertex counts agree in every frame.

    Raises InputError if they do not, for frame counts that differ, for meshes that are none (`check_track`),
    for units that look wrong, and for a body of another number of frames.
    """
    if prediction.num_frames != truth.num_frames:
        raise InputError(
            f"{prediction.name} has {prediction.num_frames} frames and {truth.name} has {truth.num_frames}; "
            "give sequences of one length"
        )
    notes = [*truth.notes, *prediction.notes]
    if not prediction.faces and not truth.faces:
        raise InputError(f"neither {prediction.name} nor {truth.name} has faces; give a mesh with --faces")
    for side, other in ((prediction, truth), (truth, prediction)):
        if not side.faces:
            notes.append(
                f"the vertices of {side.name} come without faces and are taken in the order of the other side"
            )
            if side is prediction:
                prediction = replace(side, faces=_borrowed(side, other))
            else:
                truth = replace(side, faces=_borrowed(side, other))
    for track in (truth, prediction):
        check_track(track)
    check_size(truth, "--truth-scale")
    check_size(prediction, "--scale")
    check_scales(prediction, truth)
    body = truth.body or prediction.body
    if truth.body is None and body is not None:
        notes.append(f"penetration is that into {body.name}: the truth comes without a body")
    if body is not None and body.num_frames not in (1, truth.num_frames):
        raise InputError(
            f"{body.name} has {body.num_frames} frames and {truth.name} has {truth.num_frames}; give "
            "one frame, or as many"
        )
    return Pair(prediction, replace(truth, body=body), body, tuple(notes))


def _borrowed(side: Track, other: Track) -> Sequence[np.ndarray]:
    for t in range(side.num_frames):
        mine, theirs = len(side.positions[t]), len(other.positions[t])
        if mine != theirs:
            raise InputError(
                f"{side.name}: {mine} vertices without faces, and {other.name} has {theirs} vertices in "
                f"frame {t}; give the faces of {side.name} with --faces"
            )
    return other.faces
