"""Alembic archives: a mesh whose points are sampled over time, and its body.

The wheel that reads them, alembic3d, is a repackaging of Alembic's own C++ library, which may crash on a
damaged file. So a process of its own reads, and leaves the arrays in a file.
"""

from __future__ import annotations

import subprocess
import sys
import tempfile
from importlib.util import find_spec
from pathlib import Path

from muslin.eval.read.arrays import read_npz
from muslin.eval.read.content import Content
from muslin.garments.errors import InputError

MAGIC = (b"Ogawa", b"\x89HDF")


def read_alembic(path: Path) -> Content:
    """The garment of an archive, with its transforms, one frame a sample; the rate is that of its samples.

    Raises InputError without alembic3d, for a damaged file, for one in the old HDF5 form, and if it is not
    clear which mesh is the garment.
    """
    with path.open("rb") as stream:
        head = stream.read(5)
    if not head.startswith(MAGIC):
        raise InputError(f"{path}: not an Alembic file; it must begin with Ogawa")
    if find_spec("alembic3d") is None:
        raise InputError(
            f"{path}: reading Alembic needs the package alembic3d (pip install 'muslin[alembic]', or export "
            "USD, PC2 or a folder of OBJ instead)"
        )
    with tempfile.TemporaryDirectory() as folder:
        out = Path(folder) / "frames.npz"
        child = [sys.executable, "-m", "muslin.eval.read.alembic_child", str(path), str(out)]
        done = subprocess.run(child, capture_output=True, text=True, errors="replace", check=False)
        if done.returncode == 0:
            return read_npz(out)
    said = (done.stderr.strip().splitlines() or [f"its reader stopped with code {done.returncode}"])[-1][:160]
    raise InputError(f"{path}: not readable as an Alembic file ({said}); export USD or OBJ instead")
