"""Score anything against anything: predictions against simulations, coarse against fine."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from muslin.eval.material_points import MaterialPoints
from muslin.eval.metrics.accumulate import ErrorAccumulator, PenetrationAccumulator
from muslin.eval.metrics.hausdorff import hausdorff
from muslin.eval.metrics.penetration import Penetration, signed_distances
from muslin.eval.metrics.surface_sampling import surface_distance
from muslin.eval.metrics.velocity import velocity_errors
from muslin.eval.metrics.vertex import Statistics, vertex_areas, vertex_errors
from muslin.eval.read.options import ReadOptions
from muslin.eval.read.pairing import paired
from muslin.eval.read.subject import Subject, matched, open_subject
from muslin.eval.read.track import Track
from muslin.garments.errors import InputError
from muslin.sim.dataset.sample import Sample

MM = 1000.0
SURFACE_FRAMES = 24
ONE_FRAME = "velocity errors are null: one frame only"
BY_PANEL_SPACE = (
    "where topologies differ, vertex and velocity errors are those of the truth's vertices against points of "
    "the prediction with the same panel-space coordinates"
)

Progress = Callable[[float, int, str], None]


@dataclass(frozen=True)
class FrameScores:
    """Figures of one pair frame by frame, millimetres; None where a figure does not exist.

    surface_frames    the frames that `hausdorff` and `surface` belong to
    """

    vertex_mean: list[float] | None
    vertex_max: list[float] | None
    velocity_mean: list[float] | None
    penetration_ratio: list[float] | None
    surface_frames: list[int]
    hausdorff: list[float]
    surface: list[float]


@dataclass(frozen=True)
class PairScore:
    """All figures of one prediction against one truth; JSON values, millimetres."""

    prediction: str
    truth: str
    labels: dict[str, str]
    beta: list[float]
    fps: float | None
    num_frames: int
    figures: dict[str, Any]
    frames: FrameScores


@dataclass
class Totals:
    """What the pairs add up to."""

    vertex: ErrorAccumulator = field(default_factory=ErrorAccumulator)
    velocity: ErrorAccumulator = field(default_factory=ErrorAccumulator)
    predicted: PenetrationAccumulator = field(default_factory=PenetrationAccumulator)
    true: PenetrationAccumulator = field(default_factory=PenetrationAccumulator)
    hausdorff_lower: list[float] = field(default_factory=list)
    hausdorff_upper: list[float] = field(default_factory=list)
    surface_mean: list[float] = field(default_factory=list)
    surface_rms: list[float] = field(default_factory=list)

    def merge(self, other: Totals) -> None:
        self.vertex.errors += other.vertex.errors
        self.vertex.weights += other.vertex.weights
        self.velocity.errors += other.velocity.errors
        self.velocity.weights += other.velocity.weights
        self.predicted.distances += other.predicted.distances
        self.true.distances += other.true.distances
        for name in ("hausdorff_lower", "hausdorff_upper", "surface_mean", "surface_rms"):
            getattr(self, name).extend(getattr(other, name))

    def figures(self) -> dict[str, Any]:
        """JSON values; a figure that does not exist is None."""
        return {
            "vertex_error_mm": _scaled(self.vertex.result()),
            "vertex_error_area_weighted_mm": _scaled(self.vertex.weighted_result()),
            "velocity_error_mm_s": _scaled(self.velocity.result()),
            "hausdorff_mm": MM * max(self.hausdorff_lower),
            "hausdorff_upper_mm": MM * max(self.hausdorff_upper),
            "hausdorff_mean_mm": MM * float(np.mean(self.hausdorff_lower)),
            "mean_surface_distance_mm": MM * float(np.mean(self.surface_mean)),
            "rms_surface_distance_mm": MM * float(np.sqrt(np.mean(np.square(self.surface_rms)))),
            "penetration": _penetration(self.predicted.result()),
            "truth_penetration": _penetration(self.true.result()),
        }


@dataclass(frozen=True)
class Comparison:
    """Figures over all pairs, each pair's own, and what could not be compared.

    subjects   prediction and truth, opened as they were for the figures
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

    def to_dict(self) -> dict[str, Any]:
        return {
            "prediction": self.prediction,
            "truth": self.truth,
            "samples": len(self.pairs),
            "frames": self.frames,
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
    surface_frames: int = SURFACE_FRAMES,
    progress: Progress | None = None,
    prediction_options: ReadOptions | None = None,
    truth_options: ReadOptions | None = None,
    vertices_correspond: bool = False,
) -> Comparison:
    """Compare two datasets, samples, mesh files or folders of meshes.

    Surface distances exist always, penetration where the truth has a closed body: both sides are measured
    against the truth's body. Vertex and velocity errors exist where points correspond: vertex for vertex
    where both sides have the same faces, else by panel space if both are meshes of one pattern with known
    panels. They are then those of the truth's vertices, each with the point of the prediction that has the
    same panel-space coordinates. A velocity from frame t to t + 1 is that of the truth's vertices at t + 1;
    where a side has another topology at t, its position there is looked up by panel space too.

    fps                   frames per second of folders of meshes; None leaves velocity errors out
    surface_frames        most frames of a sequence that get surface distances, evenly spread (they cost most)
    prediction_options    how files of the prediction are read (fps then stands there), and
    truth_options         those of the truth
    vertices_correspond   vertex k is the same point on both sides wherever the vertex counts agree, although
                          the triangles differ

    Raises InputError for missing, empty, non-manifold or non-finite meshes, for datasets with nothing in
    common, and for sequences of different length or rate.
    """
    if surface_frames < 1:
        raise InputError(f"surface_frames = {surface_frames}: must be 1 or more")
    second = open_subject(truth, options=truth_options or ReadOptions(fps=fps))
    first = open_subject(prediction, options=prediction_options or ReadOptions(fps=fps), ids=second.ids)
    pairs, left_first, left_second = matched(first, second)
    totals, frames = Totals(), 0
    notes: list[str] = []
    scores: list[PairScore] = []
    for done, (a, b) in enumerate(pairs):
        if progress is not None:
            progress(done, len(pairs), b)
        score, part, remarks = _score(first.load(a), second.load(b), surface_frames, vertices_correspond)
        totals.merge(part)
        scores.append(score)
        notes += [remark for remark in remarks if remark not in notes]
        frames += score.num_frames
    if progress is not None:
        progress(len(pairs), len(pairs), "")
    if totals.velocity.errors:
        notes = [note for note in notes if note != ONE_FRAME]
    return Comparison(
        prediction=str(prediction),
        truth=str(truth),
        frames=frames,
        figures=totals.figures(),
        pairs=scores,
        unmatched_prediction=left_first,
        unmatched_truth=left_second,
        notes=notes,
        subjects=(first, second),
    )


def _score(
    prediction: Track, truth: Track, surface_frames: int, vertices_correspond: bool
) -> tuple[PairScore, Totals, list[str]]:
    both = paired(prediction, truth)
    prediction, truth = both.prediction, both.truth
    T = truth.num_frames
    if T > 1 and prediction.fps != truth.fps:
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
    totals = Totals()
    notes = list(both.notes)
    _score_vertices(prediction, truth, totals, notes, vertices_correspond)
    chosen = np.unique(np.linspace(0, T - 1, min(T, surface_frames)).round().astype(int))
    if len(chosen) < T:
        notes.append(f"surface distances of {len(chosen)} of {T} frames of a sequence, evenly spread")
    for t in chosen:
        pair = (prediction.positions[t], prediction.faces[t], truth.positions[t], truth.faces[t])
        bounds, distance = hausdorff(*pair), surface_distance(*pair)
        totals.hausdorff_lower.append(bounds.lower)
        totals.hausdorff_upper.append(bounds.upper)
        totals.surface_mean.append(distance.mean)
        totals.surface_rms.append(distance.rms)
    _score_penetration(prediction, truth, totals, notes)
    return _pair(prediction, truth, totals, chosen), totals, notes


def _score_vertices(
    prediction: Track, truth: Track, totals: Totals, notes: list[str], vertices_correspond: bool
) -> None:
    points, T = MaterialPoints(vertices_correspond), truth.num_frames
    try:
        seen = [points.positions(prediction, t, truth, t) for t in range(T)]
    except InputError as error:
        notes.append(f"vertex and velocity errors are null: {error}")
        return
    for t, x in enumerate(seen):
        y = truth.positions[t]
        totals.vertex.update(vertex_errors(x, y), vertex_areas(y, truth.faces[t]))
    if T < 2:
        notes.append(ONE_FRAME)
    elif truth.fps is None:
        notes.append("velocity errors are null: the frame rate is not known; give it (--fps)")
    else:
        _score_velocities(prediction, truth, seen, points, totals, notes)
    if points.by_panel_space:
        notes.append(BY_PANEL_SPACE)


def _score_velocities(
    prediction: Track,
    truth: Track,
    seen: list[np.ndarray],
    points: MaterialPoints,
    totals: Totals,
    notes: list[str],
) -> None:
    """seen   of each frame, the prediction's positions at the truth's vertices"""
    assert truth.fps is not None
    try:
        before = [
            [points.positions(track, t - 1, truth, t) for track in (prediction, truth)]
            for t in range(1, truth.num_frames)
        ]
    except InputError as error:
        notes.append(f"velocity errors are null: {error}")
        return
    for t, (x, y) in enumerate(before, start=1):
        predicted, true = np.stack([x, seen[t]]), np.stack([y, truth.positions[t]])
        totals.velocity.update(velocity_errors(predicted, true, truth.fps)[0])


def _score_penetration(prediction: Track, truth: Track, totals: Totals, notes: list[str]) -> None:
    body = truth.body
    if body is None:
        notes.append("penetration is null: the truth has no body")
    elif not body.closed:
        notes.append("penetration is null: the truth's body or obstacle is not closed")
    else:
        for t in range(truth.num_frames):
            now = body.vertices(t)
            totals.predicted.update(signed_distances(prediction.positions[t], now, body.faces))
            totals.true.update(signed_distances(truth.positions[t], now, body.faces))


def _pair(prediction: Track, truth: Track, totals: Totals, chosen: np.ndarray) -> PairScore:
    vertex, velocity = totals.vertex.errors, totals.velocity.errors
    inside = totals.predicted.distances
    frames = FrameScores(
        vertex_mean=[MM * float(e.mean()) for e in vertex] or None,
        vertex_max=[MM * float(e.max()) for e in vertex] or None,
        velocity_mean=[MM * float(e.mean()) for e in velocity] or None,
        penetration_ratio=[float((d < 0).mean()) for d in inside] or None,
        surface_frames=chosen.tolist(),
        hausdorff=[MM * value for value in totals.hausdorff_lower],
        surface=[MM * value for value in totals.surface_mean],
    )
    sample = truth.sample
    return PairScore(
        prediction=prediction.name,
        truth=truth.name,
        labels=_labels(sample),
        beta=[] if sample is None or sample.body is None else sample.body.beta.tolist(),
        fps=truth.fps,
        num_frames=truth.num_frames,
        figures=totals.figures(),
        frames=frames,
    )


def _labels(sample: Sample | None) -> dict[str, str]:
    return {} if sample is None else {"kind": sample.kind, "fabric": sample.fabric, **sample.labels}


def _scaled(statistics: Statistics | None) -> dict[str, float] | None:
    return None if statistics is None else statistics.scaled(MM)


def _penetration(found: Penetration | None) -> dict[str, float] | None:
    if found is None:
        return None
    return {
        "ratio": found.ratio,
        "depth_mean_mm": MM * found.depth_mean,
        "depth_max_mm": MM * found.depth_max,
    }
