"""What one process of `generate` does: make the missing samples of a chain and commit them one by one."""

from __future__ import annotations

import os
import threading
import time
import traceback
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from multiprocessing.connection import Connection
from multiprocessing.connection import wait as wait_for
from pathlib import Path
from typing import Any

from muslin.garments.errors import InputError
from muslin.sim.dataset import durable, store
from muslin.sim.dataset.header import digest
from muslin.sim.dataset.jobs import Chain, Job
from muslin.sim.dataset.processes import leave_interrupts_to_parent
from muslin.sim.dataset.sample import Sample
from muslin.sim.dataset.schema import FAILED
from muslin.sim.solve.errors import LastState, SimulationError

FrameProgress = Callable[[int, int], None]
"""(work done, work in all) of one chain."""

ChainSimulator = Callable[[list[Any], str, FrameProgress | None], Iterator[Sample]]
"""(scenes of a chain, device, progress) -> the samples in order. Must be importable by name in another
process."""


@dataclass(frozen=True)
class Task:
    """What one process needs to make the missing samples of a chain."""

    place: int
    root: Path
    chain: Chain
    scenes: list[Any]
    missing: frozenset[str]
    versions: dict[str, str]
    device: str
    simulate: ChainSimulator | None


_news: Any = None


def start_worker(news: Any, leash: Connection) -> None:
    global _news
    _news = news
    leave_interrupts_to_parent()
    # What the queue still holds must not keep a worker from ending when nobody reads it any more.
    news.cancel_join_thread()
    threading.Thread(target=_end_with_parent, args=(leash,), daemon=True).start()


def _end_with_parent(leash: Connection) -> None:
    """End this process as soon as the other end of the leash is closed: by the parent, or by its death."""
    wait_for([leash])
    os._exit(1)


def make_chain(task: Task) -> dict[str, str]:
    """Make the missing samples of a chain; return {id: reason} of those that could not be made."""
    simulate = task.simulate
    if simulate is None:
        from muslin.sim.run import simulate_chain

        simulate = simulate_chain

    def tell(done: int, total: int) -> None:
        _news.put((task.place, done / max(1, total), task.chain.jobs[0].id))

    left = [job for job in task.chain.jobs if job.id in task.missing]
    started = time.perf_counter()
    try:
        samples = simulate(task.scenes, task.device, tell)
        for job, sample in zip(task.chain.jobs, samples, strict=True):
            seconds = time.perf_counter() - started
            if job.id in task.missing:
                store.write_sample(task.root, _named(job, sample, task, seconds))
                (task.root / FAILED / f"{job.id}.npz").unlink(missing_ok=True)
                left.remove(job)
            if not left:
                break
            started = time.perf_counter()
    except Exception as error:  # reported for the samples it cost; the other chains are not its business
        reason = f"{type(error).__name__}: {error}"
        if isinstance(error, SimulationError) and error.state is not None and left:
            reason += f"; the last good state is in {_keep(task.root, left[0].id, error.state)}"
        if not isinstance(error, InputError | SimulationError):
            reason += "\n" + traceback.format_exc()
        return {job.id: reason for job in left}
    _news.put((task.place, 1.0, task.chain.jobs[0].id))
    return {}


def _keep(root: Path, sample_id: str, state: LastState) -> Path:
    """Save the state in which a sample was given up; return the file."""
    path = root / FAILED / f"{sample_id}.npz"
    durable.make_folder(path.parent)
    state.save(path)
    return path


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
