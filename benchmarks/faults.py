"""What datasets are made to survive, done to them and to the processes that make them; and how to compare."""

from __future__ import annotations

import io
import json
import os
import random
import time
import zipfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

from muslin.sim.dataset import store
from muslin.sim.dataset.reader import open_dataset
from muslin.sim.dataset.root import Root, open_root

Contents = dict[str, dict[str, bytes]]
"""{sample id: {name of an entry: its bytes}}"""


def contents(place: str | Path | Root) -> Contents:
    """All that a dataset's samples hold, but the seconds that they took."""
    root = open_root(place)
    return {
        sample_id: _entries(root.read(store.sample_name(sample_id))) for sample_id in store.stored_ids(root)
    }


def table(place: str | Path | Root) -> list[dict[str, Any]]:
    """The rows of a dataset's index, but the seconds, and the size of what tells them."""
    return [
        {key: value for key, value in row.items() if key not in ("seconds", "bytes")}
        for row in open_dataset(place).rows
    ]


def _entries(data: bytes) -> dict[str, bytes]:
    with zipfile.ZipFile(io.BytesIO(data)) as archive:
        entries = {name: archive.read(name) for name in archive.namelist()}
    values = json.loads(entries["zarr.json"])
    certificate = values["attributes"]["meta"]["certificate"]
    certificate.pop("seconds")
    certificate["extra"].pop("seconds_per_frame", None)
    values["attributes"].pop("meta_sha256")
    return entries | {"zarr.json": json.dumps(values).encode()}


def flip_bit(file: Path, draw: random.Random) -> None:
    """Flip a bit of the arrays in a stored sample.

    The archive's own words are left alone: some of them, such as the times of files, say nothing.
    """
    data = file.read_bytes()
    with zipfile.ZipFile(io.BytesIO(data)) as archive:
        chunks = [entry for entry in archive.infolist() if "/c/" in entry.filename and entry.file_size]
    chunk = draw.choice(chunks)
    place = chunk.header_offset + 30 + len(chunk.filename) + draw.randrange(chunk.file_size)
    with file.open("r+b") as stream:
        stream.seek(place)
        stream.write(bytes([data[place] ^ 1 << draw.randrange(8)]))


def truncate(file: Path, draw: random.Random) -> None:
    """Cut the end of a file off."""
    with file.open("r+b") as stream:
        stream.truncate(draw.randrange(file.stat().st_size))


def workers_of(pid: int) -> list[int]:
    """Worker processes that a run started."""
    return [child for child in children(pid) if "spawn_main" in _command(child)]


def descendants(pid: int) -> list[int]:
    """Processes that a process started, and those that they started."""
    found = children(pid)
    return found + [grandchild for child in found for grandchild in descendants(child)]


def children(pid: int) -> list[int]:
    """Processes that any thread of a process started."""
    found: list[int] = []
    try:
        for thread in Path(f"/proc/{pid}/task").iterdir():
            found += [int(child) for child in (thread / "children").read_text().split()]
    except (FileNotFoundError, ProcessLookupError):
        return found
    return found


def alive(pid: int) -> bool:
    """Whether a process runs; one that has ended, and that nobody asked how, does not."""
    try:
        return Path(f"/proc/{pid}/stat").read_text().rsplit(")", 1)[1].split()[0] != "Z"
    except (FileNotFoundError, ProcessLookupError):
        return False


def send(pid: int, signal: int) -> bool:
    """Send a signal. False if there is no such process any more."""
    try:
        os.kill(pid, signal)
    except ProcessLookupError:
        return False
    return True


def wait_until(met: Callable[[], object], what: str, seconds: float = 300.0) -> None:
    """Look again and again whether a condition is met. TimeoutError if it is not."""
    end = time.monotonic() + seconds
    while not met():
        if time.monotonic() > end:
            raise TimeoutError(f"waited {seconds:.0f} s for {what}")
        time.sleep(0.02)


def _command(pid: int) -> str:
    try:
        return Path(f"/proc/{pid}/cmdline").read_bytes().replace(b"\0", b" ").decode(errors="replace")
    except (FileNotFoundError, ProcessLookupError):
        return ""
