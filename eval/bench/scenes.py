"""What a benchmark's page lets one look at: the worst, the median and the best sample of each group."""

from __future__ import annotations

from collections.abc import Sequence

from muslin.eval.bench.outcome import Outcome
from muslin.eval.read.subject import open_subject
from muslin.eval.side_by_side import side_by_side
from muslin.eval.viewer.scene import Scene
from muslin.sim.dataset import store


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
    truth = open_subject(store.sample_file(outcome.truth, sample)).load(sample)
    predictions = {}
    for key, method in outcome.methods.items():
        subject = open_subject(method.predictions[sample], None if method.is_dataset else truth.fps)
        predictions[key] = subject.load(subject.ids[0])
    return side_by_side(name, truth, predictions)
