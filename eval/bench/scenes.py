"""What a benchmark's page lets one look at: the worst, the median and the best sample of each group."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from muslin.eval.bench.outcome import Outcome
from muslin.eval.metrics.surface_sampling import point_to_surface
from muslin.eval.metrics.vertex import vertex_errors
from muslin.eval.read.subject import open_subject
from muslin.eval.read.track import Track
from muslin.eval.viewer.scene import MovingMesh, Scene
from muslin.sim.dataset import store

MM = 1000.0
TRUTH = "truth"


def scenes(outcome: Outcome) -> list[Scene]:
    """A scene for each sample worth a look; each sample once."""
    found: dict[str, str] = {}
    for group in outcome.protocol.groups:
        for what, sample in worst_median_best(outcome, outcome.groups[group.name]).items():
            found.setdefault(sample, f"{group.label}, {what}: {sample}")
    return [_scene(outcome, sample, name) for sample, name in found.items()]


def worst_median_best(outcome: Outcome, ids: Sequence[str]) -> dict[str, str]:
    """{"worst", "median", "best": sample} by the first metric, averaged over methods; each sample once."""
    metric = outcome.protocol.metrics[0]
    same = outcome.common(ids, metric.figure)
    losses = {
        i: sum(metric.loss(v) for m in outcome.methods for v in outcome.values(m, [i], metric.figure))
        for i in same
    }
    ranked = sorted(same, key=lambda i: losses[i], reverse=True)
    places = {"worst": 0, "median": len(ranked) // 2, "best": len(ranked) - 1}
    chosen: dict[str, str] = {}
    for what, place in places.items():
        if ranked and ranked[place] not in chosen.values():
            chosen[what] = ranked[place]
    return chosen


def _scene(outcome: Outcome, sample: str, name: str) -> Scene:
    truth = open_subject(store.sample_path(outcome.truth, sample)).load(sample)
    predictions = {}
    for key, method in outcome.methods.items():
        subject = open_subject(method.predictions[sample], None if method.is_dataset else truth.fps)
        predictions[key] = subject.load(subject.ids[0])
    same = all(_corresponds(track, truth) for track in predictions.values())
    sides = {TRUTH: MovingMesh(truth.positions, truth.faces)}
    for key, track in predictions.items():
        # A file may hold vertices alone; it was scored with the truth's triangles.
        faces = track.faces or truth.faces
        sides[key] = MovingMesh(track.positions, faces, _errors(track, truth, same))
    measure = "vertex error" if same else "distance to the truth's surface"
    return Scene(
        f"{name} ({measure})",
        sides,
        fps=truth.fps,
        body=_body(truth),
    )


def _corresponds(prediction: Track, truth: Track) -> bool:
    """Whether both have the same vertices in every frame."""
    return all(
        len(prediction.positions[t]) == len(truth.positions[t])
        and (not prediction.faces or np.array_equal(prediction.faces[t], truth.faces[t]))
        for t in range(truth.num_frames)
    )


def _errors(prediction: Track, truth: Track, same: bool) -> list[np.ndarray]:
    """A frame: (V_t,) millimetres."""
    found = []
    for t in range(truth.num_frames):
        x, y = prediction.positions[t], truth.positions[t]
        found.append(MM * (vertex_errors(x, y) if same else point_to_surface(x, y, truth.faces[t])))
    return found


def _body(truth: Track) -> MovingMesh | None:
    if truth.body is None:
        return None
    return MovingMesh(truth.body.positions, [truth.body.faces] * truth.body.num_frames)
