"""What a worker of `generate` does: make the missing samples of a chain and commit them one by one."""

from __future__ import annotations

import io
import time
import traceback
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, replace
from functools import lru_cache
from typing import Any

from muslin.garments.errors import InputError
from muslin.sim.dataset import store
from muslin.sim.dataset.header import digest
from muslin.sim.dataset.index import read_row, row_of
from muslin.sim.dataset.jobs import Chain, Job
from muslin.sim.dataset.quarantine import state_name
from muslin.sim.dataset.root import Root
from muslin.sim.dataset.sample import Sample
from muslin.sim.solve.errors import LastState, SimulationError

FrameProgress = Callable[[int, int], None]
"""(work done, work in all) of one chain."""

ChainSimulator = Callable[[list[Any], str, FrameProgress | None], Iterator[Sample]]
"""(scenes of a chain, device, progress) -> the samples in order. Must be importable by name in another
process."""


@dataclass(frozen=True)
class Task:
    """What a worker needs to make the missing samples of a chain. missing: ids of these."""

    root: Root
    chain: Chain
    missing: frozenset[str]
    versions: dict[str, str]
    solver: str
    device: str
    simulate: ChainSimulator | None
    make_scene: Callable[[dict[str, Any]], Any] | None

    @property
    def wanted(self) -> list[Job]:
        """The jobs whose samples are missing."""
        return [job for job in self.chain.jobs if job.id in self.missing]


@dataclass(frozen=True)
class Made:
    """What came of a chain.

    rows     index rows of the samples that were made
    failed   id of the sample at which the chain ended, with the reason and what a developer needs; or empty
    store    why the store could not be written to, which is not the sample's fault; or empty
    """

    rows: list[dict[str, Any]] = field(default_factory=list)
    failed: str = ""
    reason: str = ""
    log: tuple[str, ...] = ()
    store: str = ""


def make_chain(task: Task, tell: Callable[[Any], None]) -> Made:
    """Make the missing samples of a chain; tell [share of its work that is done, id of what it is at]."""
    left = task.wanted
    rows: list[dict[str, Any]] = []

    def told(done: int, total: int) -> None:
        tell([done / max(1, total), left[0].id])

    try:
        simulate, scenes = _prepared(task)
        samples = simulate(scenes, task.device, told)
        started = time.perf_counter()
        for job, sample in zip(task.chain.jobs, samples, strict=True):
            seconds = time.perf_counter() - started
            if job.id in task.missing:
                try:
                    rows.append(_commit(task.root, _named(job, sample, task, seconds)))
                except OSError as error:  # a full disk, or a store out of reach
                    why = f"{type(error).__name__}: {error}"
                    return Made(rows, store=why)
                left.remove(job)
            if not left:
                break
            started = time.perf_counter()
    except Exception as error:  # reported for the samples it cost; the other chains are not its business
        reason = f"{type(error).__name__}: {error}"
        if isinstance(error, SimulationError) and error.state is not None:
            try:
                reason += f"; the last good state is in {_keep(task.root, left[0].id, error.state)}"
            except OSError as unwritable:
                why = f"{type(unwritable).__name__}: {unwritable}"
                return Made(rows, store=why)
        log = tuple(traceback.format_exc().splitlines())
        return Made(rows, left[0].id, reason, log)
    return Made(rows)


def _prepared(task: Task) -> tuple[ChainSimulator, list[Any]]:
    if _solver(task.simulate) != task.solver:
        raise InputError(
            "this worker has another solver than the process that sent the work; give all machines the same "
            "muslin and the same versions of what it needs (python, numpy, scipy, warp-lang, ipctk, zarr)"
        )
    if task.simulate is not None:
        simulate = task.simulate
    else:
        from muslin.sim.run import simulate_chain as simulate

        _compile(task.device)
    if task.make_scene is not None:
        make_scene = task.make_scene
    else:
        from muslin.sim.scene import parse_scene as make_scene
    return simulate, [make_scene(job.scene) for job in task.chain.jobs]


@lru_cache
def _solver(simulate: ChainSimulator | None) -> str:
    from muslin.sim.dataset.solver import solver_digest

    return solver_digest(simulate)


@lru_cache
def _compile(device: str) -> None:
    """Compile the kernels, once a machine: workers that start together would all compile the same."""
    from muslin.sim.compile import compile_once

    compile_once(device)


def _commit(root: Root, sample: Sample) -> dict[str, Any]:
    stored = store.write_sample(root, sample)
    root.remove(state_name(sample.id))
    if not stored.new:  # by another generator, to the same geometry
        return read_row(root, sample.id)
    return row_of(stored.meta, stored.checksums, stored.size)


def _keep(root: Root, sample_id: str, state: LastState) -> str:
    """Save the state in which a sample was given up; return its place."""
    stream = io.BytesIO()
    state.save(stream)
    root.write(state_name(sample_id), stream.getvalue())
    return root.place(state_name(sample_id))


def _named(job: Job, sample: Sample, task: Task, seconds: float) -> Sample:
    certificate = replace(
        sample.certificate,
        seed=job.seed,
        config_hash=digest(job.scene),
        seconds=sample.certificate.seconds or seconds,
        versions=task.versions | sample.certificate.versions,
    )
    return replace(
        sample,
        id=job.id,
        kind=job.kind,  # type: ignore[arg-type]
        seed=job.seed,
        scene=sample.scene or job.scene,
        labels=sample.labels | job.labels,
        fabric=sample.fabric or job.labels.get("fabric", ""),
        certificate=certificate,
    )
