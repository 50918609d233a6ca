"""Find the samples of a dataset that are not as they should be, set them aside, and make them again."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from muslin.garments.errors import InputError
from muslin.sim.body.load import load_body
from muslin.sim.dataset import store
from muslin.sim.dataset.config import parse_config
from muslin.sim.dataset.engine import Cluster
from muslin.sim.dataset.generate import generate
from muslin.sim.dataset.header import read_header
from muslin.sim.dataset.index import stored_rows, write_index
from muslin.sim.dataset.progress import Progress
from muslin.sim.dataset.root import Root, StoreError, open_root
from muslin.sim.dataset.schema import HEADER
from muslin.sim.dataset.verify import verify
from muslin.sim.dataset.worker import ChainSimulator


@dataclass(frozen=True)
class RepairReport:
    """What was found, what was done, and what is still wrong.

    checked   samples that were looked at
    damaged   {sample id: why}, before the repair, in dataset order
    missing   planned samples that were not there, and in no index either: made too
    index     why the index could not be read; empty if it could
    made      ids of the samples that were made (again)
    aside     {sample id: where what was there lies now}
    failed    {sample id: why} after the repair: could not be made again, or is wrong again
    dry       nothing was done
    """

    checked: int
    damaged: dict[str, str]
    missing: tuple[str, ...] = ()
    index: str = ""
    made: tuple[str, ...] = ()
    aside: dict[str, str] = field(default_factory=dict)
    failed: dict[str, str] = field(default_factory=dict)
    dry: bool = False

    @property
    def passed(self) -> bool:
        """Whether all is well now."""
        wrong = bool(self.damaged or self.missing or self.index)
        return not (wrong if self.dry else self.failed)


def repair(
    path: str | Path | Root,
    *,
    ids: Collection[str] | None = None,
    workers: int | None = None,
    cluster: Cluster | None = None,
    device: str = "cpu",
    dry: bool = False,
    progress: Progress | None = None,
    simulate: ChainSimulator | None = None,
    make_scene: Callable[[dict[str, Any]], Any] | None = None,
) -> RepairReport:
    """Verify every sample; make again what fails, and what is missing, from the config in the header.

    What is there of a sample that fails is moved to `failed/ID.zarr.zip-N`: nothing is deleted. Samples
    that are well are not touched, and those made again are, on the machine that made them, the same to
    the bit. They are verified in turn; one that fails again (it is wrong by its making, not damaged) is
    in `failed` of the report. An index that cannot be read is written anew.

    ids                    look at these only; unless given, all; samples in quarantine are tried again
    workers, cluster       as for `generate`
    dry                    only tell; nothing is written
    simulate, make_scene   as for `generate`

    Raises InputError, before anything is moved, if the folder is no dataset, if the header is damaged, if the
    config does not plan what is to be made again, if another solver made the dataset, or if a body is not
    the one that it was made with.
    """
    root = open_root(path)
    header = read_header(root)
    index_error, listed = _index(root)
    there = {*listed, *store.stored_ids(root)}
    if ids is not None:
        _check_ids(root, ids, there | header.splits.keys())
    chosen = [sample_id for sample_id in there if ids is None or sample_id in ids]
    found = verify(root, ids=chosen, workers=workers, progress=progress)
    missing = tuple(i for i in header.splits if i not in there and (ids is None or i in ids))
    report = RepairReport(found.samples, found.failed, missing, index_error, dry=dry)
    if dry:
        return report
    if not found.failed and not missing:
        if index_error:
            with root.lock():
                write_index(root, header)
        return report
    _check_bodies(root, there)
    config = parse_config(
        header.config, f"{root.place(HEADER)}: not a dataset that can be made again: its config"
    )
    result = generate(
        config,
        root,
        workers=workers,
        cluster=cluster,
        device=device,
        progress=progress,
        simulate=simulate,
        make_scene=make_scene,
        again=(*found.failed, *missing),
    )
    checked = verify(root, ids=result.made, workers=workers, progress=progress)
    return replace(report, made=result.made, aside=result.aside, failed=result.failed | checked.failed)


def _check_bodies(root: Root, ids: Iterable[str]) -> None:
    """Raise InputError if a body is not, or is not any more, the one that the samples were made with.

    Such samples fail verification too, but they are not what is damaged: made again, they would be others.
    """
    bodies: dict[str, str] = {}
    for sample_id in ids:
        try:
            body = store.read_meta(root, sample_id)[0]["body"]
        except StoreError:
            raise
        except InputError:
            continue  # damaged: it is made again
        if body:
            bodies[body["model"]] = body["digest"]
    for model, known in bodies.items():
        found = load_body(model).digest
        if found != known:
            raise InputError(
                f"body model {model!r} has digest {found[:12]}…, but samples of {root} were made with "
                f"{known[:12]}…; put the file back that they were made with"
            )


def _check_ids(root: Root, ids: Collection[str], known: Collection[str]) -> None:
    unknown = sorted(set(ids) - set(known))
    if unknown:
        raise InputError(
            f"{root}: has and plans no sample {unknown[0]!r}; see `muslin info {root} --samples`"
        )


def _index(root: Root) -> tuple[str, list[str]]:
    """Why the index cannot be read, or no reason; the ids that it lists."""
    try:
        return "", list(stored_rows(root))
    except InputError as error:
        return str(error), []
