"""Score anything against anything: predictions against simulations, coarse against fine."""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from muslin.eval.cost import Cost, read_cost
from muslin.eval.material_points import MaterialPoints
from muslin.eval.provenance import provenance
from muslin.eval.read.options import ReadOptions
from muslin.eval.read.pairing import Pair, paired
from muslin.eval.read.subject import Subject, matched, open_subject
from muslin.eval.score.families import chosen
from muslin.eval.score.family import Family, as_json
from muslin.eval.score.frame import UnavailableError, frames_of
from muslin.eval.score.motion import ONE_FRAME
from muslin.garments.errors import InputError
from muslin.sim.dataset.sample import Sample

SURFACE_FRAMES = 24
BY_PANEL_SPACE = (
    "where topologies differ, errors at vertices, edges and faces are those of the truth's against points of "
    "the prediction with the same panel-space coordinates"
)

Progress = Callable[[float, int, str], None]


@dataclass(frozen=True)
class PairScore:
    """All figures of one prediction against one truth; JSON values.

    figures   by name, units in the names; None where there is none
    frames    by name, frame by frame; None where there are none. "surface_frames" are the frames that
              "hausdorff" and "surface" belong to; a velocity or acceleration belongs to the last of the
              frames that it is taken from
    """

    prediction: str
    truth: str
    labels: dict[str, str]
    beta: list[float]
    fps: float | None
    num_frames: int
    figures: dict[str, Any]
    frames: dict[str, list[Any] | None]


@dataclass(frozen=True)
class Comparison:
    """Figures over all pairs, each pair's own, and what could not be compared.

    subjects   prediction and truth, opened as they were for the figures
    origin     of `muslin.eval.provenance`: what the figures were computed from and by
    """

    prediction: str
    truth: str
    frames: int
    figures: dict[str, Any]
    pairs: list[PairScore]
    unmatched_prediction: list[str]
    unmatched_truth: list[str]
    notes: list[str]
    subjects: tuple[Subject, Subject]
    origin: dict[str, Any]

    def to_dict(self) -> dict[str, Any]:
        return {
            "prediction": self.prediction,
            "truth": self.truth,
            "samples": len(self.pairs),
            "frames": self.frames,
            "origin": self.origin,
            **self.figures,
            "notes": self.notes,
            "unmatched": {"prediction": self.unmatched_prediction, "truth": self.unmatched_truth},
            "pairs": [asdict(pair) for pair in self.pairs],
        }

    def to_json(self) -> str:
        return json.dumps(self.to_dict(), indent=1, allow_nan=False) + "\n"


def compare(
    prediction: str | Path,
    truth: str | Path,
    *,
    fps: float | None = None,
    metrics: Sequence[str] = ("standard",),
    surface_frames: int = SURFACE_FRAMES,
    progress: Progress | None = None,
    prediction_options: ReadOptions | None = None,
    truth_options: ReadOptions | None = None,
    vertices_correspond: bool = False,
) -> Comparison:
    """Compare two datasets, samples, mesh files or folders of meshes.

    Distances between surfaces, of curvature, and intersections exist always; penetration where there is a
    body: both sides are measured against that of the truth, if it has one. Errors at vertices, edges and
    faces exist where points correspond: vertex for vertex where both sides have the same faces, else by panel
    space if both are meshes of one pattern with known panels. They are then those of the truth's vertices,
    each with the point of the prediction that has the same panel-space coordinates. A derivative over time is
    that of the truth's vertices in its last frame; where a side had another topology before, its positions
    there are looked up by panel space too. What cannot be computed is null, and a note says why.

    fps                   frames per second of folders of meshes; None leaves derivatives over time out
    metrics               names of families, `muslin.eval.score.families`; "standard" or "all" for several
    surface_frames        most frames of a sequence that get surface distances, which cost most, evenly spread
    prediction_options    how files of the prediction are read (fps then stands there), and
    truth_options         those of the truth
    vertices_correspond   vertex k is the same point on both sides wherever the vertex counts agree, although
                          the triangles differ

    Raises InputError for missing, empty, non-manifold or non-finite meshes, for datasets with nothing in
    common, for sequences of different length or rate, and for metrics that are none.
    """
    if surface_frames < 1:
        raise InputError(f"surface_frames = {surface_frames}: must be 1 or more")
    families = chosen(metrics)
    second = open_subject(truth, options=truth_options or ReadOptions(fps=fps))
    first = open_subject(prediction, options=prediction_options or ReadOptions(fps=fps), ids=second.ids)
    pairs, left_first, left_second = matched(first, second)
    totals: list[Family] = []
    notes: Counter[str] = Counter()
    scores: list[PairScore] = []
    for done, (a, b) in enumerate(pairs):

        def tell(share: float, done: int = done, name: str = b) -> None:
            if progress is not None:
                progress(done + share, len(pairs), name)

        pair = paired(first.load(a), second.load(b))
        _check_rates(pair)
        points = MaterialPoints(vertices_correspond)
        parts = _seen(pair, points, [family(pair) for family in families], surface_frames, tell)
        scores.append(_score(pair, parts))
        notes.update(list(dict.fromkeys(_remarks(pair, points, parts))))
        for total, part in zip(totals, parts, strict=False):
            total.merge(part)
        totals = totals or parts
    if progress is not None:
        progress(len(pairs), len(pairs), "")
    return Comparison(
        prediction=str(prediction),
        truth=str(truth),
        frames=sum(score.num_frames for score in scores),
        figures=_figures(totals) | {"cost": as_json(_cost(Path(prediction)))},
        pairs=scores,
        unmatched_prediction=left_first,
        unmatched_truth=left_second,
        notes=_counted(notes, len(pairs)),
        subjects=(first, second),
        origin=provenance(truth),
    )


def _seen(
    pair: Pair,
    points: MaterialPoints,
    parts: list[Family],
    most_chosen: int,
    tell: Callable[[float], None],
) -> list[Family]:
    """The families after all frames of a pair; new ones in place of those that lack something."""
    lacking: dict[Family, str] = {}
    for frame in frames_of(pair, points, most_chosen):
        tell(frame.t / pair.truth.num_frames)
        for part in parts:
            if part not in lacking:
                try:
                    part.update(frame)
                except (UnavailableError, InputError) as error:
                    lacking[part] = f"{part.what} null: {error}"
    return [_without(part, pair, lacking[part]) if part in lacking else part for part in parts]


def _without(part: Family, pair: Pair, note: str) -> Family:
    empty = type(part)(pair)
    empty.notes = [note]
    return empty


def _remarks(pair: Pair, points: MaterialPoints, parts: Sequence[Family]) -> list[str]:
    remarks = [*pair.notes, *(note for part in parts for note in part.notes)]
    return [*remarks, BY_PANEL_SPACE] if points.by_panel_space else remarks


def _counted(notes: Counter[str], pairs: int) -> list[str]:
    """Each note once, with the number of samples if it is not that of all."""
    found = []
    for note, count in notes.items():
        if count == pairs:
            found.append(note)
        # Drapes among sequences have no velocities, as everyone knows.
        elif not note.endswith(ONE_FRAME):
            found.append(f"{note} ({count} of {pairs} samples)")
    return found


def _check_rates(pair: Pair) -> None:
    prediction, truth = pair.prediction, pair.truth
    if truth.num_frames == 1 or prediction.fps == truth.fps:
        return
    if prediction.fps is None or truth.fps is None:
        unknown = prediction if prediction.fps is None else truth
        raise InputError(
            f"{unknown.name}: the frame rate of mesh files is not known; "
            f"give it with --fps, for example --fps {prediction.fps or truth.fps:g}"
        )
    raise InputError(
        f"{prediction.name} has {prediction.fps} frames per second and {truth.name} has {truth.fps}; "
        "resample one of them"
    )


def _score(pair: Pair, parts: Sequence[Family]) -> PairScore:
    sample = pair.truth.sample
    frames = {name: list(values) or None for part in parts for name, values in part.frames().items()}
    return PairScore(
        prediction=pair.prediction.name,
        truth=pair.truth.name,
        labels=_labels(sample),
        beta=[] if sample is None or sample.body is None else sample.body.beta.tolist(),
        fps=pair.truth.fps,
        num_frames=pair.truth.num_frames,
        figures=_figures(parts),
        frames=frames,
    )


def _figures(parts: Sequence[Family]) -> dict[str, Any]:
    return {name: value for part in parts for name, value in part.figures().items()}


def _labels(sample: Sample | None) -> dict[str, str]:
    return {} if sample is None else {"kind": sample.kind, "fabric": sample.fabric, **sample.labels}


def _cost(prediction: Path) -> Cost | None:
    """What the prediction cost, if its folder says so."""
    return read_cost(prediction) if prediction.is_dir() else None
