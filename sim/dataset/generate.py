"""Make the samples of a dataset over local processes; stop at any moment, run again, and it goes on."""

from __future__ import annotations

import multiprocessing
import queue
import time
from collections.abc import Callable, Collection, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, Protocol

from muslin.garments.errors import InputError
from muslin.sim.dataset import durable, store
from muslin.sim.dataset.aside import set_aside
from muslin.sim.dataset.card import write_card
from muslin.sim.dataset.config import DatasetConfig
from muslin.sim.dataset.header import Header, prepare_root
from muslin.sim.dataset.index import read_index, write_index
from muslin.sim.dataset.jobs import Plan
from muslin.sim.dataset.plan import plan
from muslin.sim.dataset.processes import one_thread_each, usable_cores, worker_died
from muslin.sim.dataset.schema import LOCK
from muslin.sim.dataset.solver import solver_digest
from muslin.sim.dataset.sources import check_sources
from muslin.sim.dataset.worker import ChainSimulator, Task, make_chain, start_worker


class Progress(Protocol):
    """What `generate` tells while it runs."""

    def __call__(self, done: float, total: int, message: str) -> None:
        """done: samples made, with the begun ones in parts; total: samples to make."""


@dataclass(frozen=True)
class GenerateReport:
    """What `generate` did.

    made, kept   ids in plan order; `kept` were there already
    failed       {id: reason}
    aside        {id: place} of what was set aside to be made again
    card         False if README.md is not the dataset's card but somebody's own, and was left as it is
    """

    made: tuple[str, ...]
    kept: tuple[str, ...]
    failed: dict[str, str] = field(default_factory=dict)
    seconds: float = 0.0
    aside: dict[str, Path] = field(default_factory=dict)
    card: bool = True


def generate(
    config: DatasetConfig,
    out: str | Path,
    *,
    workers: int | None = None,
    device: str = "cpu",
    progress: Progress | None = None,
    simulate: ChainSimulator | None = None,
    make_scene: Callable[[dict[str, Any]], Any] | None = None,
    again: Collection[str] = (),
) -> GenerateReport:
    """Make every planned sample that is not there yet.

    The same configuration gives the same ids and, on one machine, the same bytes of geometry, whatever the
    number of workers and however often the run was killed: a sample is committed whole or not at all, and a
    chain of drapes of which any is missing is made again from its start.

    workers      processes; by default one a usable core on the CPU, one on a GPU
    simulate     `muslin.sim.run.simulate_chain` unless given
    make_scene   from the values of a scene file to a scene; `muslin.sim.scene.parse_scene` unless given
    again        ids of samples to make again: once nothing stands in the way of that, what is there of them
                 is moved to `failed/`

    A chain that fails is reported in `failed`; the others go on. Raises InputError for a configuration or a
    scene that cannot be or names what is not there, for a folder that may not be written to (see
    `prepare_root`), and when a process dies.
    """
    root = Path(out)
    started = time.perf_counter()
    if workers is not None and workers < 1:
        raise InputError(f"workers = {workers}: must be 1 or more")
    planned = plan(config)
    strangers = sorted(set(again) - planned.splits.keys())
    if strangers:
        raise InputError(
            f"{root}: {', '.join(strangers[:3])}: not planned by the dataset's config, so not to be made "
            f"again from it ({len(strangers)} in all); restore them from a copy, or take them out of the "
            "dataset"
        )
    scenes = _scenes(planned, make_scene or _default_make_scene())
    if make_scene is None:
        check_sources(scene for chain in scenes for scene in chain)
    solver = solver_digest(simulate)
    header = Header(config=config.model_dump(mode="json"), splits=planned.splits, solver_digest=solver)
    before = prepare_root(root, header)
    with durable.exclusive(root / LOCK):
        stored = store.stored_ids(root)
        there = {sample_id for sample_id in stored if sample_id not in again}
        missing = frozenset(job.id for job in planned.jobs if job.id not in there)
        # Samples to be made again must be those of the solver that made them, even where no other is left.
        _check_solver(root, before, header, bool(missing), bool(stored or again))
        places = {sample_id: set_aside(root, sample_id) for sample_id in again}
        if before is not None and not missing:
            header = replace(header, solver_digest=before.solver_digest, versions=before.versions)
        header.write(root)
        store.clean_partial(root)
        todo = [
            Task(k, root, chain, chain_scenes, missing, header.versions, device, simulate)
            for k, (chain, chain_scenes) in enumerate(zip(planned.chains, scenes, strict=True))
            if any(job.id in missing for job in chain.jobs)
        ]
        failed = _run(todo, workers, device, progress or _silent) if todo else {}
        store.clean_partial(root)
        write_index(root, header)
        card = write_card(root, header, read_index(root, header), planned.jobs)
    made = tuple(job.id for job in planned.jobs if job.id in missing and job.id not in failed)
    kept = tuple(job.id for job in planned.jobs if job.id in there)
    aside = {sample_id: place for sample_id, place in places.items() if place is not None}
    return GenerateReport(made, kept, failed, time.perf_counter() - started, aside, card)


def _check_solver(root: Path, before: Header | None, header: Header, missing: bool, there: bool) -> None:
    if before is None or not missing or not there or before.solver_digest == header.solver_digest:
        return
    changed = [
        f"{key} {before.versions.get(key, 'absent')} -> {value}"
        for key, value in header.versions.items()
        if before.versions.get(key) != value
    ]
    raise InputError(
        f"{root}: its samples were made by another solver ({', '.join(changed) or 'its code changed'}); "
        "one dataset holds the samples of one solver: write to another folder, or install what made them"
    )


def _scenes(planned: Plan, make_scene: Callable[[dict[str, Any]], Any]) -> list[list[Any]]:
    scenes = []
    for chain in planned.chains:
        made = []
        for job in chain.jobs:
            try:
                made.append(make_scene(job.scene))
            except (InputError, ValueError) as error:
                raise InputError(f"scene of sample {job.id}: {error}") from error
        scenes.append(made)
    return scenes


def _default_make_scene() -> Callable[[dict[str, Any]], Any]:
    from muslin.sim.scene import parse_scene

    return parse_scene


def _silent(done: float, total: int, message: str) -> None:
    pass


def _run(todo: Sequence[Task], workers: int | None, device: str, progress: Progress) -> dict[str, str]:
    """Run the chains over processes; return {id: reason} of the samples that could not be made."""
    usable = usable_cores() if device == "cpu" else 1
    count = min(workers or usable, len(todo))
    if any(task.simulate is None for task in todo):
        progress(0.0, 0, "compiling kernels")
        from muslin.sim.run import compile_kernels

        compile_kernels(device)
    context = multiprocessing.get_context("spawn")
    news: Any = context.Queue()
    leash, held = context.Pipe(duplex=False)
    weight = {task.place: len(task.missing.intersection(job.id for job in task.chain.jobs)) for task in todo}
    parts = dict.fromkeys(weight, 0.0)
    failed: dict[str, str] = {}
    with one_thread_each():
        pool = ProcessPoolExecutor(
            count, mp_context=context, initializer=start_worker, initargs=(news, leash)
        )
        try:
            # Sequences first: a long one begun last would leave the other cores idle.
            order = sorted(todo, key=lambda task: task.chain.jobs[0].kind != "sequence")
            pending: set[Future[dict[str, str]]] = {pool.submit(make_chain, task) for task in order}
            while pending:
                finished, pending = wait(pending, timeout=0.2, return_when=FIRST_COMPLETED)
                for future in finished:
                    failed |= future.result()
                message = _drain(news, parts)
                progress(sum(parts[k] * weight[k] for k in weight), sum(weight.values()), message)
        except BrokenProcessPool as error:
            raise worker_died(count, "; what was finished is kept") from error
        except BaseException:
            held.close()  # ends the workers, whatever they are at
            raise
        finally:
            pool.shutdown(wait=True, cancel_futures=True)
            held.close()
            leash.close()
            news.close()
    progress(float(sum(weight.values()) - len(failed)), sum(weight.values()), "")
    return failed


def _drain(news: Any, parts: dict[int, float]) -> str:
    message = ""
    while True:
        try:
            place, part, message = news.get_nowait()
        except queue.Empty:
            return message
        parts[place] = part
