"""Which solver made a sample, as one digest."""

from __future__ import annotations

import hashlib
import importlib
from pathlib import Path

from muslin.sim.dataset.header import canonical, installed_versions
from muslin.sim.dataset.worker import ChainSimulator


def solver_digest(simulate: ChainSimulator | None = None) -> str:
    """sha256 over the sources and data that decide the geometry: `muslin.garments` and `muslin.sim` (without
    `dataset`, `view` and the tools that bake assets), or the module of another simulator; with the versions
    installed.
    """
    total = hashlib.sha256(canonical(installed_versions()))
    if simulate is not None:
        total.update(f"{simulate.__module__}.{simulate.__qualname__}".encode())
        return total.hexdigest()
    for package in ("muslin.garments", "muslin.sim"):
        folder = Path(importlib.import_module(package).__path__[0])
        for file in sorted(p for p in folder.rglob("*") if p.suffix in _SOURCES):
            inner = file.relative_to(folder)
            if not _ASIDE.isdisjoint(inner.parts):
                continue
            total.update(inner.as_posix().encode())
            total.update(hashlib.sha256(file.read_bytes()).digest())
    return total.hexdigest()


_SOURCES = {".py", ".toml", ".npz", ".json"}
_ASIDE = {"dataset", "view", "bake", "retarget", "__pycache__"}
