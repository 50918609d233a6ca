"""Lines of a benchmark's figures: means over the samples at each x, with intervals."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import product
from typing import Any

import numpy as np

from muslin.eval.bench.outcome import Outcome
from muslin.eval.bench.protocol import BETA, GROUP, METHOD, Figure
from muslin.eval.bench.score import Score
from muslin.eval.bench.tables import label_values, shown
from muslin.eval.metrics.bootstrap import Interval, mean_interval, mean_intervals
from muslin.garments.errors import InputError

BAND_RESAMPLES = 2000
OF_SURFACE_FRAMES = ("surface", "hausdorff")
"""Figures of single frames whose names begin so are of `surface_frames` alone."""


@dataclass(frozen=True)
class Curve:
    """A line: of a method, and of the `rest` of what tells lines apart.

    low, high   of the mean at each x; None where samples are too few
    n           samples at each x
    """

    method: str
    rest: str
    x: list[float]
    mean: list[float]
    low: list[float | None]
    high: list[float | None]
    n: list[int]


@dataclass(frozen=True)
class Plot:
    """A figure's lines; categories: names of x = 0, 1, …, of a label's values."""

    title: str
    x_label: str
    y_label: str
    curves: list[Curve]
    categories: list[str] | None = None


def plots(outcome: Outcome, figure: Figure) -> list[Plot]:
    """The plot of a figure, or one for each value of its label `each`; of the samples that all methods have.

    Raises InputError if no sample has the figure, or no shape for x = beta.
    """
    if figure.each is None:
        return [_plot(outcome, figure, {}, figure.title)]
    ids = outcome.common(outcome.chosen(figure.groups))
    return [
        _plot(outcome, figure, {figure.each: value}, f"{figure.title}: {value}")
        for value in label_values(outcome, ids, figure.each)
    ]


def _plot(outcome: Outcome, figure: Figure, labels: dict[str, str], title: str) -> Plot:
    ids = outcome.common(outcome.chosen(figure.groups, labels))
    if figure.over_frames:
        return _over_frames(outcome, figure, ids, title)
    places, x_label, categories = _places(outcome, figure, ids)
    curves = [
        curve
        for method, rest, chosen in _lines(outcome, figure, ids)
        if (curve := _curve(outcome, method, rest, chosen, figure.y, places)).x
    ]
    if not curves:
        raise InputError(f"figure {title!r}: no sample has {figure.y}; see the notes of `muslin eval`")
    y_label = figure.y_label or outcome.protocol.metric(figure.y).heading
    return Plot(title, x_label, y_label, curves, categories)


def _lines(outcome: Outcome, figure: Figure, ids: Sequence[str]) -> list[tuple[str, str, list[str]]]:
    """(method, the rest of what a line is of, its samples) of each line of a figure."""
    rest = [name for name in figure.lines if name != METHOD]
    values = [
        list(figure.groups or outcome.groups) if name == GROUP else label_values(outcome, ids, name)
        for name in rest
    ]
    allowed, found = set(ids), []
    for method in outcome.methods:
        for place in (dict(zip(rest, key, strict=True)) for key in product(*values)):
            groups = [place[GROUP]] if GROUP in place else figure.groups
            labels = {key: value for key, value in place.items() if key != GROUP}
            chosen = [i for i in outcome.chosen(groups, labels) if i in allowed]
            names = [shown(outcome, name, value) for name, value in place.items()]
            if chosen:
                found.append((method, ", ".join(names), chosen))
    return found


def _places(
    outcome: Outcome, figure: Figure, ids: Sequence[str]
) -> tuple[dict[str, float], str, list[str] | None]:
    """x of each sample, the axis' label, and the names of categories."""
    if figure.x != BETA and figure.component is None:
        categories = label_values(outcome, ids, figure.x)
        return {i: categories.index(outcome.entries[i].labels.get(figure.x, "")) for i in ids}, "", categories
    betas = {i: _score(outcome, i).beta for i in ids}
    size = max((len(beta) for beta in betas.values()), default=0)
    if size == 0:
        raise InputError(f"figure {figure.title!r}: x = {figure.x!r}, but no sample has a body with a shape")
    padded = {i: [*beta, *[0.0] * (size - len(beta))] for i, beta in betas.items()}
    component = figure.component
    if component is None:
        component = int(np.ptp(np.array(list(padded.values())), axis=0).argmax())
    if component >= size:
        raise InputError(
            f"figure {figure.title!r}: x = {figure.x!r}, but shapes have components 0 to {size - 1}"
        )
    label = f"shape coefficient {component}, standard deviations"
    return {i: round(beta[component], 6) for i, beta in padded.items()}, label, None


def _curve(
    outcome: Outcome, method: str, rest: str, ids: Sequence[str], figure: str, places: dict[str, float]
) -> Curve:
    same = outcome.common(ids, figure)
    curve = Curve(method, rest, [], [], [], [], [])
    options = outcome.protocol.bootstrap
    for x in sorted({places[i] for i in same}):
        here = [i for i in same if places[i] == x]
        found = mean_interval(
            outcome.values(method, here, figure),
            outcome.clusters(here),
            options.confidence,
            min(BAND_RESAMPLES, options.resamples),
            options.seed,
        )
        _add(curve, x, found)
    return curve


def _over_frames(outcome: Outcome, figure: Figure, ids: Sequence[str], title: str) -> Plot:
    curves = []
    for method, rest, chosen in _lines(outcome, figure, ids):
        rows = {i: _frame_values(_score(outcome, i, method), figure.y) for i in chosen}
        # A sample that one method lacks the figure of is left out for all of them.
        whole = [
            i
            for i in chosen
            if all(_frame_values(_score(outcome, i, other), figure.y) for other in outcome.methods)
        ]
        if whole:
            rate = _rate(outcome, whole, title) if figure.x == "time" else 1.0
            curves.append(_frame_curve(outcome, method, rest, {i: rows[i] for i in whole}, rate))
    if not curves:
        raise InputError(f"figure {title!r}: no sample has {figure.y} frame by frame")
    x_label = "time, s" if figure.x == "time" else "frame"
    return Plot(title, x_label, figure.y_label, curves)


def _frame_curve(
    outcome: Outcome, method: str, rest: str, rows: dict[str, dict[int, float]], rate: float
) -> Curve:
    """Sequences may be of different length: frames with the same samples are resampled together."""
    curve = Curve(method, rest, [], [], [], [], [])
    options = outcome.protocol.bootstrap
    with_samples: dict[tuple[str, ...], list[int]] = {}
    for frame in sorted({frame for row in rows.values() for frame in row}):
        with_samples.setdefault(tuple(i for i, row in rows.items() if frame in row), []).append(frame)
    for ids, frames in with_samples.items():
        means, low, high = mean_intervals(
            [[rows[i][frame] for frame in frames] for i in ids],
            outcome.clusters(ids),
            options.confidence,
            min(BAND_RESAMPLES, options.resamples),
            options.seed,
        )
        for k, frame in enumerate(frames):
            few = bool(np.isnan(low[k]))
            bounds = (None, None) if few else (float(low[k]), float(high[k]))
            _add(curve, frame / rate, Interval(float(means[k]), bounds[0], bounds[1], len(ids)))
    return curve


def _frame_values(score: Score, name: str) -> dict[int, float]:
    """{frame: value} of a figure of single frames; empty where it does not exist for this sample.

    A figure of surfaces is of `surface_frames`; one of velocities, which the first frame has not, is shorter
    than the sequence and ends with it.
    """
    if name not in score.frames or name == "surface_frames":
        known = ", ".join(key for key in score.frames if key != "surface_frames")
        raise InputError(f"figures over frames: {name!r} is not among {known}; choose one of them")
    values = score.frames[name]
    if not values:
        return {}
    if name.startswith(OF_SURFACE_FRAMES):
        frames = score.frames["surface_frames"]
    else:
        frames = range(score.num_frames - len(values), score.num_frames)
    return {int(t): float(v) for t, v in zip(frames, values, strict=True) if v is not None}


def _rate(outcome: Outcome, ids: Sequence[str], title: str) -> float:
    rates = {outcome.entries[i].fps for i in ids}
    rate = rates.pop()
    if rates or rate is None:
        raise InputError(f"figure {title!r}: x = 'time' needs sequences of one frame rate; use x = 'frame'")
    return rate


def _score(outcome: Outcome, sample: str, method: str | None = None) -> Score:
    found = outcome.score(method or next(iter(outcome.methods)), sample)
    assert found is not None, "only samples that all methods have"
    return found


def _add(curve: Curve, x: float, found: Interval) -> None:
    curve.x.append(x)
    curve.mean.append(found.mean)
    curve.low.append(found.low)
    curve.high.append(found.high)
    curve.n.append(found.n)


def plot_dict(plot: Plot) -> dict[str, Any]:
    """JSON values of a plot, one entry a point."""
    return {"title": plot.title, "x": plot.x_label, "y": plot.y_label, "points": long_points(plot)}


def long_points(plot: Plot) -> list[dict[str, Any]]:
    """One dict a point: line, x, mean, low, high, samples."""
    names = plot.categories
    return [
        {
            "method": curve.method,
            "line": curve.rest,
            "x": names[int(x)] if names else x,
            "mean": mean,
            "low": low,
            "high": high,
            "samples": n,
        }
        for curve in plot.curves
        for x, mean, low, high, n in zip(curve.x, curve.mean, curve.low, curve.high, curve.n, strict=True)
    ]
