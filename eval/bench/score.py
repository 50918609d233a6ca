"""Scores each prediction against its truth, in as many processes as wanted."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from muslin.eval.compare import compare
from muslin.garments.errors import InputError
from muslin.sim.dataset.processes import in_processes


@dataclass(frozen=True)
class Task:
    """One prediction against one sample; fps for predictions that do not know theirs."""

    method: str
    sample: str
    prediction: Path
    truth: Path
    fps: float | None
    families: tuple[str, ...]
    surface_frames: int


@dataclass(frozen=True)
class Score:
    """What came of a task: JSON values as in a pair of `Comparison.to_dict`; or why there are none."""

    method: str
    sample: str
    figures: dict[str, Any] = field(default_factory=dict)
    frames: dict[str, Any] = field(default_factory=dict)
    beta: tuple[float, ...] = ()
    num_frames: int = 0
    notes: tuple[str, ...] = ()
    refused: str = ""


def scores(tasks: Sequence[Task], workers: int) -> Iterator[Score]:
    """Scores in the order of the tasks. A prediction that cannot be scored says so in `refused`."""
    yield from in_processes(run, tasks, workers)


def run(task: Task) -> Score:
    """Score one prediction."""
    try:
        found = compare(
            task.prediction,
            task.truth,
            fps=task.fps,
            metrics=task.families,
            surface_frames=task.surface_frames,
        )
    except InputError as error:
        return Score(task.method, task.sample, refused=" ".join(str(error).split()))
    values = found.to_dict()
    pair = values["pairs"][0]
    return Score(
        task.method,
        task.sample,
        figures=pair["figures"],
        frames=pair["frames"],
        beta=tuple(pair["beta"]),
        num_frames=pair["num_frames"],
        notes=tuple(values["notes"]),
    )


def figure_value(figures: dict[str, Any], path: str) -> float | None:
    """The figure at a dotted path; None where it does not exist for this sample.

    Raises InputError for a path that no sample has, listing those there are.
    """
    value: Any = figures
    for part in path.split("."):
        if value is None:
            return None
        if not isinstance(value, dict) or part not in value:
            raise _unknown(figures, path)
        value = value[part]
    if value is None:
        return None
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise _unknown(figures, path)
    if not math.isfinite(value):
        raise InputError(f"figure {path!r} is {value}; correct the prediction, or its truth")
    return float(value)


def figure_paths(figures: dict[str, Any], prefix: str = "") -> list[str]:
    """Dotted paths of all numbers; of a figure that does not exist, the path of its table."""
    paths: list[str] = []
    for name, value in figures.items():
        if isinstance(value, dict):
            paths += figure_paths(value, f"{prefix}{name}.")
        elif value is None or (isinstance(value, int | float) and not isinstance(value, bool)):
            paths.append(prefix + name)
    return paths


def check_figures(paths: Iterable[str], score: Score) -> None:
    """Raise InputError if a path is of no figure, or a figure is not finite."""
    for path in paths:
        try:
            figure_value(score.figures, path)
        except InputError as error:
            raise InputError(f"{score.method}, {score.sample}: {error}") from error


def _unknown(figures: dict[str, Any], path: str) -> InputError:
    return InputError(
        f"figure {path!r} is not among those of a sample; choose from {', '.join(figure_paths(figures))}"
    )
