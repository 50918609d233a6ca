"""Runs a protocol: every method's prediction of every sample, scored and gathered."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from pathlib import Path

from muslin.eval.bench.methods import open_method
from muslin.eval.bench.outcome import Outcome
from muslin.eval.bench.protocol import Protocol
from muslin.eval.bench.score import Score, Task, check_figures, scores
from muslin.eval.bench.select import entries, grouped, labels_needed
from muslin.eval.provenance import provenance
from muslin.eval.score.families import chosen
from muslin.garments.errors import InputError
from muslin.sim.dataset import store
from muslin.sim.dataset.processes import usable_cores
from muslin.sim.dataset.reader import open_dataset

Progress = Callable[[float, int, str], None]


def bench(
    protocol: Protocol,
    methods: Mapping[str, str | Path],
    dataset: str | Path | None = None,
    *,
    workers: int | None = None,
    progress: Progress | None = None,
) -> Outcome:
    """Score methods on the samples of a protocol.

    methods   {name: folder of its predictions} (see `open_method`), at least one
    dataset   the truth; None takes the protocol's
    workers   processes; None takes one a core

    A sample that a method lacks, or whose prediction cannot be scored (NaN, another number of frames), is
    counted and named for that method; means and comparisons are over the samples that all methods have.
    Raises InputError for what is wrong with the protocol, the dataset or the methods, and if no sample is
    left.
    """
    started = time.perf_counter()
    given = dataset if dataset is not None else protocol.dataset
    if given is None:
        raise InputError(f"protocol {protocol.name}: names no dataset; give one with --dataset")
    if not methods:
        raise InputError("no method to score; give at least one, --method NAME=DIR")
    chosen(protocol.families)  # raises for one that is none, before the long work
    truth = Path(given)
    samples = entries(open_dataset(truth), labels_needed(protocol))
    groups = grouped(protocol, samples, str(truth))
    wanted = {entry.id for chosen in groups.values() for entry in chosen}
    scored = {entry.id: entry for entry in samples if entry.id in wanted}
    opened = {name: open_method(name, Path(path), truth, list(scored)) for name, path in methods.items()}
    tasks = [
        Task(
            name,
            i,
            method.predictions[i],
            store.sample_file(truth, i),
            None if method.is_dataset else entry.fps,
            tuple(protocol.families),
            protocol.surface_frames,
        )
        for i, entry in scored.items()
        for name, method in opened.items()
        if i in method.predictions
    ]
    outcome = Outcome(
        protocol=protocol,
        truth=truth,
        entries=scored,
        groups={name: [entry.id for entry in chosen] for name, chosen in groups.items()},
        methods=opened,
        scores=_run(protocol, tasks, workers or usable_cores(), progress),
        origin=provenance(truth) | {"protocol": protocol.hash},
        seconds=time.perf_counter() - started,
    )
    _check_common(outcome)
    return outcome


def _run(
    protocol: Protocol, tasks: list[Task], workers: int, progress: Progress | None
) -> dict[tuple[str, str], Score]:
    found: dict[tuple[str, str], Score] = {}
    for score in scores(tasks, workers):
        if not score.refused:
            check_figures((metric.figure for metric in protocol.metrics), score)
        found[score.method, score.sample] = score
        if progress is not None:
            progress(len(found), len(tasks), f"{score.method}: {score.sample}")
    return found


def _check_common(outcome: Outcome) -> None:
    if outcome.common(list(outcome.entries)):
        return
    reasons = [
        f"{name} lacks {len(outcome.missing(name))} and has {len(refused)} that cannot be scored"
        + (f" ({next(iter(refused.values()))})" if refused else "")
        for name in outcome.methods
        if (refused := outcome.refused(name)) or outcome.missing(name)
    ]
    raise InputError(
        f"none of the {len(outcome.entries)} samples has a prediction of every method: {'; '.join(reasons)}"
    )
