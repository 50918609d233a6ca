"""Make the samples of a dataset over many processes; stop at any moment, run again, and it goes on."""

from __future__ import annotations

import contextlib
import shlex
import time
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from muslin.garments.errors import InputError
from muslin.sim.dataset import store
from muslin.sim.dataset.aside import set_aside
from muslin.sim.dataset.card import write_card
from muslin.sim.dataset.config import DatasetConfig
from muslin.sim.dataset.engine import Cluster, Died, Done, Engine, News, open_engine
from muslin.sim.dataset.header import Header, prepare_root
from muslin.sim.dataset.index import read_row, stored_rows, write_index
from muslin.sim.dataset.jobs import Chain, Plan
from muslin.sim.dataset.plan import plan
from muslin.sim.dataset.progress import Progress, Tally
from muslin.sim.dataset.quarantine import Quarantined, quarantine, quarantined_ids, release, state_name
from muslin.sim.dataset.reader import Dataset
from muslin.sim.dataset.root import Root, open_root
from muslin.sim.dataset.schema import PICTURE
from muslin.sim.dataset.solver import solver_digest
from muslin.sim.dataset.sources import check_sources
from muslin.sim.dataset.worker import ChainSimulator, Made, Task, make_chain

INDEX_S, INDEX_SHARE = 120.0, 0.05
"""Between two writings of the index while samples are made, at least; and the most of the time that they may
take."""


BEHIND = "comes after "
"""Begins the reason of a sample that could not be made because one before it in its chain could not."""


@dataclass(frozen=True)
class GenerateReport:
    """What `generate` did.

    made, kept   ids in plan order; `kept` were there already
    failed       {id: reason} of what could not be made in this run, `BEHIND` others in their chains included
    held         ids in quarantine since an earlier run, and those behind them in their chains: not tried
    aside        {id: place} of what was set aside to be made again
    card         False if README.md is not the dataset's card but somebody's own, and was left as it is
    """

    made: tuple[str, ...]
    kept: tuple[str, ...]
    failed: dict[str, str] = field(default_factory=dict)
    held: tuple[str, ...] = ()
    seconds: float = 0.0
    aside: dict[str, str] = field(default_factory=dict)
    card: bool = True


def generate(
    config: DatasetConfig,
    out: str | Path | Root,
    *,
    workers: int | None = None,
    cluster: Cluster | None = None,
    device: str = "cpu",
    progress: Progress | None = None,
    simulate: ChainSimulator | None = None,
    make_scene: Callable[[dict[str, Any]], Any] | None = None,
    again: Collection[str] = (),
    retry: bool = False,
    picture: bool = False,
) -> GenerateReport:
    """Make every planned sample that is not there yet.

    The same configuration gives the same ids and, on one kind of machine, the same bytes of geometry,
    whatever the workers, their number, order and deaths, and however often the run was killed: a sample
    is committed whole or not at all, and a chain of drapes of which any is missing is made again from its
    start.

    out          folder, or a URL that fsspec knows; with workers on other machines, one that all reach
    workers      short for Cluster(workers=workers)
    cluster      which workers do it; by default one a usable core on the CPU, one on a GPU
    simulate     `muslin.sim.run.simulate_chain` unless given
    make_scene   from the values of a scene file to a scene; `muslin.sim.scene.parse_scene` unless given
    again        ids of samples to make again: once nothing stands in the way of that, what is there of them
                 is moved to `failed/`
    retry        try samples in quarantine again
    picture      draw some of the samples beside the card, too

    A sample that fails, or whose worker dies time after time, goes into quarantine (`failed/ID.json`), with
    the rest of its chain; the others go on. Raises InputError for a configuration or a scene that cannot be
    or names what is not there, and for a place that may not be written to (see `prepare_root`).
    """
    root = open_root(out)
    started = time.perf_counter()
    where = cluster or Cluster(workers=workers)
    planned = plan(config)
    strangers = sorted(set(again) - planned.splits.keys())
    if strangers:
        raise InputError(
            f"{root}: {', '.join(strangers[:3])}: not planned by the dataset's config, so not to be made "
            f"again from it ({len(strangers)} in all); restore them from a copy, or take them out of the "
            "dataset"
        )
    _check_scenes(planned, make_scene)
    solver = solver_digest(simulate)
    header = Header(config=config.model_dump(mode="json"), splits=planned.splits, solver_digest=solver)
    before = prepare_root(root, header)
    with _unwritable_told(root), root.lock():
        stored = store.stored_ids(root)
        there = {sample_id for sample_id in stored if sample_id not in again}
        missing = frozenset(job.id for job in planned.jobs if job.id not in there)
        # Samples to be made again must be those of the solver that made them, even where no other is left.
        _check_solver(root, before, header, bool(missing), bool(stored or again))
        places = {sample_id: set_aside(root, sample_id) for sample_id in again}
        if before is not None and not missing:
            header = replace(header, solver_digest=before.solver_digest, versions=before.versions)
        header.write(root)
        root.clean()
        held = quarantined_ids(root) & missing
        release(root, [sample_id for sample_id in sorted(held) if retry or sample_id in again])
        held = frozenset() if retry else held - set(again)
        tasks = [
            Task(root, chain, wanted, header.versions, solver, device, simulate, make_scene)
            for chain in planned.chains
            if (wanted := missing.intersection(job.id for job in chain.jobs))
        ]
        ready = [task for task in tasks if held.isdisjoint(task.missing)]
        known = {row_id: row for row_id, row in _known_rows(root).items() if row_id in there}
        run = _Run(root, header, known, Tally(root, sum(len(task.missing) for task in ready), progress))
        if ready:
            run.over(where, ready)
        root.clean()
        rows = write_index(root, header, run.rows)
        made = missing.intersection(run.rows)
        if picture and (made or not root.exists(PICTURE)):
            _draw(Dataset(root, header, rows), run.tally)
        run.tally.end("finished")
        card = write_card(root, header, rows, planned.jobs)
    order = [job.id for job in planned.jobs]
    skipped = set().union(*(task.missing for task in tasks if not held.isdisjoint(task.missing)))
    return GenerateReport(
        made=tuple(i for i in order if i in made),
        kept=tuple(i for i in order if i in there),
        failed=run.failed,
        held=tuple(i for i in order if i in skipped),
        seconds=time.perf_counter() - started,
        aside={sample_id: place for sample_id, place in places.items() if place is not None},
        card=card,
    )


class _Run:
    """One run over the missing chains. rows: {id: index row} of what is there; failed: {id: reason}."""

    def __init__(self, root: Root, header: Header, rows: Mapping[str, dict[str, Any]], tally: Tally) -> None:
        self.root, self.header, self.tally = root, header, tally
        self.rows = dict(rows)
        self.failed: dict[str, str] = {}

    def over(self, cluster: Cluster, tasks: Sequence[Task]) -> None:
        if cluster.scheduler is None and any(task.simulate is None for task in tasks):
            self.tally.stage("compiling kernels")
            from muslin.sim.compile import compile_once

            compile_once(tasks[0].device)
        # Sequences first: a long one begun last would leave the other cores idle.
        order = sorted(tasks, key=lambda task: task.chain.jobs[0].kind != "sequence")
        self.tally.stage("starting workers")
        with open_engine(cluster.fitted(len(order), order[0].device)) as engine:
            self.tally.open(engine.dashboard)
            self._follow(engine, order)

    def _follow(self, engine: Engine, order: Sequence[Task]) -> None:
        due = time.monotonic() + INDEX_S
        try:
            for event in engine.run(make_chain, order):
                if isinstance(event, Done):
                    self._finished(event.place, order[event.place], event.found)
                elif isinstance(event, News):
                    share, at = event.said
                    self.tally.news(event.place, share, at, len(order[event.place].wanted))
                else:
                    self.tally.tick()
                if time.monotonic() > due:
                    due = self._write_index()
        except BaseException:
            # However it ends, what was made is listed, so that nobody has to read it all to know.
            with contextlib.suppress(OSError):  # the first error tells more
                write_index(self.root, self.header, self.rows)
                self.tally.end("stopped")
            raise

    def _write_index(self) -> float:
        """Write what is known so far; return when to do it next."""
        begun = time.monotonic()
        write_index(self.root, self.header, self.rows)
        ended = time.monotonic()
        return ended + max(INDEX_S, (ended - begun) / INDEX_SHARE)

    def _finished(self, place: int, task: Task, found: Made | Died) -> None:
        wanted = [job.id for job in task.wanted]
        if isinstance(found, Died):
            rest = [i for i in wanted if not self.root.exists(store.sample_name(i))]
            self.rows |= {i: read_row(self.root, i) for i in wanted if i not in rest}
            if rest:
                self._fail(task, rest, rest[0], found.reason, found.log)
            self.tally.finished(place, len(wanted) - len(rest), len(rest))
            return
        if found.store:
            raise OSError(found.store)
        self.rows |= {row["id"]: row for row in found.rows}
        rest = wanted[len(found.rows) :]
        if found.failed:
            self._fail(task, rest, found.failed, found.reason, found.log)
        self.tally.finished(place, len(found.rows), len(rest))

    def _fail(
        self, task: Task, rest: Sequence[str], sample_id: str, reason: str, log: tuple[str, ...]
    ) -> None:
        """Put the first of `rest` into quarantine; the others fail with it."""
        quarantine(self.root, _entry(self.root, task.chain, sample_id, reason, log, task.versions))
        self.failed[sample_id] = reason
        for behind in rest[1:]:
            self.failed[behind] = f"{BEHIND}{sample_id} in its chain"


def _draw(dataset: Dataset, tally: Tally) -> None:
    from muslin.sim.view.overview import overview

    if len(dataset):
        tally.stage("drawing")
        dataset.root.write(PICTURE, overview(dataset))


@contextlib.contextmanager
def _unwritable_told(root: Root) -> Iterator[None]:
    """A full disk or a store out of reach, as an InputError."""
    try:
        yield
    except OSError as error:
        raise InputError(
            f"{root}: cannot be written to ({error}); make room, or wait until the store is back, and run "
            "again: what was finished is kept"
        ) from error


def _entry(
    root: Root, chain: Chain, sample_id: str, reason: str, log: tuple[str, ...], versions: dict[str, str]
) -> Quarantined:
    place = next(k for k, job in enumerate(chain.jobs) if job.id == sample_id)
    state = state_name(sample_id)
    return Quarantined(
        id=sample_id,
        reason=reason.splitlines()[0],
        log=log,
        command=shlex.join(["muslin", "repair", str(root), "--sample", sample_id, "--workers", "1"]),
        seed=chain.jobs[place].seed,
        scenes=tuple(job.scene for job in chain.jobs[: place + 1]),
        state=root.place(state) if root.exists(state) else "",
        versions=versions,
    )


def _known_rows(root: Root) -> dict[str, dict[str, Any]]:
    try:
        return stored_rows(root)
    except InputError:
        return {}  # a damaged index is written anew, from the samples


def _check_solver(root: Root, before: Header | None, header: Header, missing: bool, there: bool) -> None:
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


def _check_scenes(planned: Plan, make_scene: Callable[[dict[str, Any]], Any] | None) -> None:
    """Raise InputError for a scene that cannot be, or, of real ones, that names what is not there."""
    if make_scene is None:
        from muslin.sim.scene import parse_scene

        check_sources(_scene(job.id, job.scene, parse_scene) for job in planned.jobs)
        return
    for job in planned.jobs:
        _scene(job.id, job.scene, make_scene)


def _scene(sample_id: str, values: dict[str, Any], make_scene: Callable[[dict[str, Any]], Any]) -> Any:
    try:
        return make_scene(values)
    except (InputError, ValueError) as error:
        raise InputError(f"scene of sample {sample_id}: {error}") from error
