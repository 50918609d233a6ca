"""The formats of moving surfaces: one line each."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from muslin.eval.read.alembic import read_alembic
from muslin.eval.read.arrays import read_npy, read_npz
from muslin.eval.read.content import Content
from muslin.eval.read.meshes import MESH_SUFFIXES, read_mesh
from muslin.eval.read.pickles import read_pickle
from muslin.eval.read.pointcache import read_pointcache
from muslin.eval.read.sequence import of_surfaces
from muslin.eval.read.usd import read_usd
from muslin.garments.errors import InputError

MOVING: dict[str, Callable[[Path], Content]] = {
    ".npy": read_npy,
    ".npz": read_npz,
    ".pc2": read_pointcache,
    ".pc16": read_pointcache,
    ".pkl": read_pickle,
    ".pickle": read_pickle,
    ".usd": read_usd,
    ".usda": read_usd,
    ".usdc": read_usd,
    ".usdz": read_usd,
    ".abc": read_alembic,
}


def read_file(path: Path) -> Content:
    """One file of any format, by its suffix. Raises InputError for a file of none, and as its reader."""
    suffix = path.suffix.lower()
    if suffix in MESH_SUFFIXES:
        return of_surfaces([read_mesh(path)])
    if suffix not in MOVING:
        raise InputError(
            f"{path}: {path.suffix!r} is no mesh format; allowed: {', '.join((*MESH_SUFFIXES, *MOVING))}"
        )
    return MOVING[suffix](path)
