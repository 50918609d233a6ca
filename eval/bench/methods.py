"""What a method predicts: a dataset, or a folder with one file or folder of meshes for each sample."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from muslin.eval.cost import Cost, read_cost
from muslin.eval.read.subject import open_subject
from muslin.garments.errors import InputError
from muslin.sim.dataset import store
from muslin.sim.dataset.reader import open_dataset
from muslin.sim.dataset.root import open_root
from muslin.sim.dataset.schema import HEADER


@dataclass(frozen=True)
class Method:
    """A method and its predictions.

    predictions   {id of the truth's sample: where its prediction lies}; without those that are missing
    is_dataset    whether predictions are samples, which know their frame rate
    cost          what the predictions cost, if the folder says so (`muslin.eval.cost`)
    """

    name: str
    path: Path
    predictions: dict[str, Path]
    is_dataset: bool
    cost: Cost | None = None


def parse_methods(given: Sequence[str]) -> dict[str, Path]:
    """{name: folder} of entries "NAME=DIR". Raises InputError for another form and for a name given twice."""
    methods: dict[str, Path] = {}
    for entry in given:
        name, equals, folder = entry.partition("=")
        name = name.strip()
        if not (equals and name and folder) or "|" in name:
            raise InputError(f"--method {entry!r}: must be NAME=DIR, for example ours=out/prediction")
        if name in methods:
            raise InputError(f"--method: two methods are named {name!r}; give each a name of its own")
        methods[name] = Path(folder)
    return methods


def open_method(name: str, path: Path, truth: Path, ids: Sequence[str]) -> Method:
    """Find a method's prediction of each sample of the truth.

    A dataset's samples belong to those of the truth with the same id; where ids differ (the same scenes
    simulated on coarser meshes, say), to the only one of the same garment, body, fabric and motion. In any
    other folder, a file or folder of meshes belongs to the sample whose id it is named after.

    Raises InputError if the folder is missing, is the truth itself, or predicts none of the samples.
    """
    where = f"--method {name}={path}"
    if not path.is_dir():
        raise InputError(f"{where}: no such folder; give the dataset, or folder of meshes, that it predicted")
    if path.resolve() == truth.resolve():
        raise InputError(f"{where}: is the truth itself; give what the method predicted")
    is_dataset = (path / HEADER).is_file()
    found = _of_dataset(path, truth, ids) if is_dataset else _of_folder(path, ids, where)
    if not found:
        raise InputError(
            f"{where}: predicts none of the {len(ids)} samples that are scored ({', '.join(ids[:3])} …); "
            "predictions carry the ids of the truth's samples"
        )
    return Method(name, path, found, is_dataset, read_cost(path))


def _of_dataset(path: Path, truth: Path, ids: Sequence[str]) -> dict[str, Path]:
    own = set(open_dataset(path).ids)
    found = {i: store.sample_file(path, i) for i in ids if i in own}
    lacking = [i for i in ids if i not in own]
    spare = own - set(store.stored_ids(open_root(truth)))
    if lacking and spare:
        theirs = _only_ones(open_subject(path).keys, spare)
        ours = _only_ones(open_subject(truth).keys, lacking)
        found |= {ours[key]: store.sample_file(path, theirs[key]) for key in ours.keys() & theirs.keys()}
    return found


def _only_ones(keys: dict[str, tuple[Any, ...]], among: Iterable[str]) -> dict[tuple[Any, ...], str]:
    """{key: the sample with it}, without keys that several samples have (topologies of one garment, say)."""
    wanted = set(among)
    times = Counter(keys.values())
    return {key: i for i, key in keys.items() if i in wanted and times[key] == 1}


def _of_folder(path: Path, ids: Sequence[str], where: str) -> dict[str, Path]:
    wanted, found = set(ids), dict[str, Path]()
    for entry in sorted(path.iterdir()):
        name = entry.name if entry.is_dir() else entry.stem
        if name not in wanted:
            continue
        if name in found:
            raise InputError(
                f"{where}: both {found[name].name} and {entry.name} are of sample {name}; keep one of them"
            )
        found[name] = entry
    return found
