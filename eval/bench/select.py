"""Which samples of a dataset a protocol scores, in which groups."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from typing import Any

from muslin.eval.bench.protocol import BETA, GROUP, METHOD, METRIC, OVER_FRAMES, Group, Protocol, Selection
from muslin.garments.errors import InputError
from muslin.sim.dataset import store
from muslin.sim.dataset.reader import Dataset

OF_INDEX = ("kind", "split", "garment", "design", "shape", "sequence", "fabric", "body")
"""Labels that the index of a dataset holds; others are read from the samples."""
TOPOLOGY = "topology"
SOME = 8


@dataclass(frozen=True)
class Entry:
    """A sample of the truth.

    labels     what protocols go by; those of `OF_INDEX`, and where asked for `topology` and the sample's own
    topology   sha256 of its faces, by which a topology is known; "" where not asked for
    """

    id: str
    labels: dict[str, str]
    frames: int
    fps: float | None
    topology: str = ""

    def identity(self, label: str) -> str:
        """What makes two samples the same in a label."""
        return self.topology if label == TOPOLOGY else self.labels.get(label, "")


def labels_needed(protocol: Protocol) -> set[str]:
    """Every label that a protocol names."""
    names: set[str] = set()
    for selection in (protocol.select, *protocol.groups):
        names |= {*selection.where, *selection.seen, *selection.unseen}
    for table in protocol.tables:
        names |= {*table.rows, *table.columns}
    for figure in protocol.figures:
        names |= {*figure.lines, *([figure.each] if figure.each else [])}
        if not (figure.over_frames or figure.x == BETA or figure.component is not None):
            names.add(figure.x)
    if protocol.bootstrap.cluster is not None:
        names.add(protocol.bootstrap.cluster)
    return names - {METHOD, GROUP, METRIC, *OVER_FRAMES}


def entries(dataset: Dataset, labels: Iterable[str]) -> list[Entry]:
    """All samples of a dataset with the labels asked for. Raises InputError for a label that none has."""
    wanted = set(labels)
    make = _read if wanted - set(OF_INDEX) else _listed
    found = [make(dataset, row) for row in dataset.rows]
    for name in sorted(wanted):
        if not any(entry.labels.get(name) for entry in found):
            known = sorted({key for entry in found for key, value in entry.labels.items() if value})
            raise InputError(
                f"{dataset.root}: no sample has a label {name!r}; labels there are {', '.join(known)}"
            )
    return found


def _listed(dataset: Dataset, row: dict[str, Any]) -> Entry:
    return Entry(row["id"], {name: row[name] or "" for name in OF_INDEX}, row["frames"], row["fps"])


def _read(dataset: Dataset, row: dict[str, Any]) -> Entry:
    meta, checksums = store.read_meta(dataset.root, row["id"])
    listed = _listed(dataset, row)
    topology = checksums["faces"]
    labels = {TOPOLOGY: topology[:SOME]} | meta["labels"] | {k: v for k, v in listed.labels.items() if v}
    return Entry(listed.id, labels, listed.frames, listed.fps, topology)


def grouped(protocol: Protocol, samples: Sequence[Entry], source: str) -> dict[str, list[Entry]]:
    """{name of a group: its samples}, in the dataset's order.

    source    what the samples are from, for errors
    Raises InputError for a group without a sample, saying which criterion leaves none, for splits and values
    of labels that no sample has, and where what was seen cannot be known, since no training sample is there.
    """
    _check_names(protocol, samples, source)
    training = [entry for entry in samples if entry.labels["split"] in protocol.train]
    result = {}
    for group in protocol.groups:
        chosen, steps = list(samples), [f"{len(samples)} samples"]
        for what, keep in _criteria(protocol, group, training, source):
            chosen = [entry for entry in chosen if keep(entry)]
            steps.append(f"{what} leaves {len(chosen)}")
            if not chosen:
                raise InputError(f"{source}: group {group.name!r} has no sample: {', '.join(steps)}")
        result[group.name] = chosen
    return result


Criterion = tuple[str, Callable[[Entry], bool]]


def _criteria(protocol: Protocol, group: Group, training: Sequence[Entry], source: str) -> list[Criterion]:
    both: tuple[Selection, ...] = (protocol.select, group)
    criteria: list[Criterion] = []
    for part in both:
        if part.kind is not None:
            criteria.append((f"kind = {part.kind!r}", _among("kind", [part.kind])))
    splits = [part.splits for part in both if part.splits]
    for names in splits:
        criteria.append((f"splits = {names}", _among("split", names)))
    if not splits:
        names = protocol.train
        criteria.append((f"every split but {', '.join(names)}", _among("split", names, inside=False)))
    for part in both:
        for label, values in part.where.items():
            criteria.append((f"{label} = {values}", _among(label, values)))
        for label in (*part.seen, *part.unseen):
            if not training:
                raise InputError(
                    f"{source}: no sample of the training splits ({', '.join(protocol.train)}) is there, so "
                    f"which {label} was seen in training cannot be known; give the whole dataset, correct "
                    "train, or name the samples with where"
                )
            known = {entry.identity(label) for entry in training}
            inside = label in part.seen
            criteria.append((f"{'seen' if inside else 'unseen'} {label}", _known(label, known, inside)))
    return criteria


def _among(label: str, values: Iterable[str], inside: bool = True) -> Callable[[Entry], bool]:
    allowed = set(values)
    return lambda entry: (entry.labels.get(label, "") in allowed) == inside


def _known(label: str, known: set[str], inside: bool) -> Callable[[Entry], bool]:
    return lambda entry: (entry.identity(label) in known) == inside


def _check_names(protocol: Protocol, samples: Sequence[Entry], source: str) -> None:
    for selection in (protocol.select, *protocol.groups):
        for label, values in (*selection.where.items(), ("split", selection.splits)):
            known = {entry.labels.get(label, "") for entry in samples}
            for value in values:
                if value not in known:
                    some = ", ".join(sorted(known)[:SOME])
                    raise InputError(f"{source}: no sample has {label} {value!r}; there are {some}")
