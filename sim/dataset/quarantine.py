"""Samples that were given up: why, and all that is needed to look into it; later runs leave them alone.

A chain ends at the sample that fails, because the next drape starts from it. So a chain is left alone as long
as any of its missing samples is in quarantine.
"""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from typing import Any

from muslin.sim.dataset.root import Root
from muslin.sim.dataset.schema import FAILED

_SUFFIX = ".json"


@dataclass(frozen=True)
class Quarantined:
    """Why a sample was given up.

    reason     in one line
    log        traceback, or what the machines said
    command    does it again, alone
    scenes     of its chain up to the sample itself, which begin where its chain begins
    state      place of the last good state; empty if there is none, as where the process died
    versions   of what made it
    """

    id: str
    reason: str
    log: tuple[str, ...]
    command: str
    seed: int
    scenes: tuple[dict[str, Any], ...]
    state: str
    versions: dict[str, str]


def state_name(sample_id: str) -> str:
    """Name of the last good state of a sample under the root."""
    return f"{FAILED}/{sample_id}.npz"


def quarantine(root: Root, entry: Quarantined) -> None:
    """Put a sample into quarantine."""
    root.write(_name(entry.id), (json.dumps(asdict(entry), indent=1) + "\n").encode())


def quarantined_ids(root: Root) -> frozenset[str]:
    """Ids of all samples in quarantine."""
    return frozenset(name.removesuffix(_SUFFIX) for name in root.names(FAILED) if name.endswith(_SUFFIX))


def read_quarantined(root: Root, sample_id: str) -> Quarantined:
    """Why a sample is in quarantine. FileNotFoundError if it is not."""
    values = json.loads(root.read(_name(sample_id)))
    return Quarantined(**{**values, "log": tuple(values["log"]), "scenes": tuple(values["scenes"])})


def release(root: Root, ids: Sequence[str]) -> None:
    """Take samples out of quarantine, and their last good states away."""
    for sample_id in ids:
        root.remove(_name(sample_id))
        root.remove(state_name(sample_id))


def _name(sample_id: str) -> str:
    return f"{FAILED}/{sample_id}{_SUFFIX}"
