"""What a figure was computed from and by: the truth's content, versions, the definitions of the metrics."""

from __future__ import annotations

import hashlib
from importlib.metadata import version
from pathlib import Path
from typing import Any

from muslin.garments.errors import InputError
from muslin.sim.dataset import store
from muslin.sim.dataset.header import digest
from muslin.sim.dataset.reader import open_dataset
from muslin.sim.dataset.root import open_root
from muslin.sim.dataset.schema import HEADER, SAMPLES, SUFFIX

METRICS_VERSION = 1
"""Raised by one when a figure of `muslin eval` changes its meaning, so that old figures are not compared."""

PACKAGES = ("muslin", "numpy", "scipy", "libigl", "ipctk")
_BLOCK = 1 << 20


def provenance(truth: str | Path) -> dict[str, Any]:
    """JSON values that tell what figures against this truth were computed from and by."""
    return {
        "versions": {name: version(name) for name in PACKAGES},
        "metrics_version": METRICS_VERSION,
        "dataset": content_hash(truth),
    }


def content_hash(path: str | Path) -> str:
    """sha256 (hex) of what a truth holds, wherever it lies.

    Of a dataset: the ids, splits, frame rates, bodies and checksums of its samples, which its index has, so
    that no array is read. Of a sample: its id and checksums. Of a file or folder of meshes: names and bytes.
    Raises InputError if there is nothing.
    """
    root = Path(path)
    if (root / HEADER).is_file():
        columns = ("split", "fps", "body", "geometry_sha256")
        return digest({row["id"]: [row[name] for name in columns] for row in open_dataset(root).rows})
    if root.name.endswith(SUFFIX) and root.parent.name == SAMPLES:
        sample_id = root.name.removesuffix(SUFFIX)
        meta, checksums = store.read_meta(open_root(root.parent.parent), sample_id)
        return digest([sample_id, meta["fps"], meta["body"], checksums])
    files = [root] if root.is_file() else sorted(file for file in root.rglob("*") if file.is_file())
    if not files:
        raise InputError(f"{root}: no such file or folder; give a dataset, a sample or meshes")
    base = root.parent if root.is_file() else root
    return digest({file.relative_to(base).as_posix(): _file_hash(file) for file in files})


def _file_hash(file: Path) -> str:
    found = hashlib.sha256()
    with file.open("rb") as stream:
        while block := stream.read(_BLOCK):
            found.update(block)
    return found.hexdigest()
