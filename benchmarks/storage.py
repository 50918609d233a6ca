"""What positions cost on disk, coded in several ways, and how long one frame takes to read."""

from __future__ import annotations

import io
import tempfile
import time
import zipfile
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import zarr
from zarr.codecs import BloscCname, BloscCodec, BloscShuffle, TransposeCodec
from zarr.core.array import Array

from muslin.sim.dataset import codecs, store
from muslin.sim.dataset.reader import Dataset, open_dataset
from muslin.sim.dataset.remeshed import RemeshedSequence
from muslin.sim.dataset.schema import ARRAYS, chunk_rows
from muslin.sim.rounding import to_grid

CHOSEN = "grid, pcodec of x, y, z apart"
_TIME_INNERMOST = TransposeCodec(order=(2, 1, 0))


def _blosc(shuffle: BloscShuffle) -> BloscCodec:
    return BloscCodec(cname=BloscCname.zstd, clevel=5, shuffle=shuffle)


_BLOSC: dict[str, dict[str, Any]] = {
    "blosc zstd 5, bytes shuffled": {"compressors": [_blosc(BloscShuffle.shuffle)]},
    "blosc zstd 5, bits shuffled": {"compressors": [_blosc(BloscShuffle.bitshuffle)]},
    "blosc zstd 5, time innermost": {
        "filters": [_TIME_INNERMOST],
        "compressors": [_blosc(BloscShuffle.shuffle)],
    },
}


@dataclass
class Row:
    """One way to store positions: bytes on disk, the largest move of a vertex in metres, CPU seconds."""

    name: str
    bytes: int = 0
    error: float = 0.0
    encode: float = 0.0
    decode: float = 0.0


@dataclass(frozen=True)
class Storage:
    """raw: bytes of all positions as float32; on_disk: {array: bytes in the dataset as it is}, with those of
    `attributes` and what the `archive` itself takes; first, again: seconds of reading frames drawn at random
    through `Dataset.frame`, each sample for the first time, then again."""

    samples: int
    frames: int
    raw: int
    rows: tuple[Row, ...]
    on_disk: dict[str, int]
    first: tuple[float, ...]
    again: tuple[float, ...]

    def table(self) -> str:
        lines = [
            f"{self.samples} samples of one topology, {self.frames} frames, {self.raw / 1e6:.1f} MB raw",
            "",
            "| positions | share of float32 | largest error, µm | coding, ms a frame | decoding |",
            "| --- | --- | --- | --- | --- |",
        ]
        for row in self.rows:
            encode, decode = (1e3 * seconds / self.frames for seconds in (row.encode, row.decode))
            share, error = row.bytes / self.raw, 1e6 * row.error
            lines.append(f"| {row.name} | {share:.1%} | {error:.1f} | {encode:.2f} | {decode:.2f} |")
        total = sum(self.on_disk.values())
        parts = sorted(self.on_disk.items(), key=lambda part: -part[1])
        lines += [
            "",
            f"The dataset as it is: {total / 1e6:.2f} MB, {total / self.raw:.0%} of that float32. Of it:",
        ]
        lines += [
            ", ".join(f"{name} {size / total:.0%}" for name, size in parts if size >= 0.02 * total) + "."
        ]
        for name, seconds in (("the first of a sample", self.first), ("another", self.again)):
            middle, slow = 1e3 * np.percentile(seconds, [50, 95])
            lines.append(f"Reading one frame, {name}: median {middle:.1f} ms, 95th percentile {slow:.1f} ms.")
        return "\n".join(lines)


def measure(source: Path, reads: int) -> Storage:
    """Code the positions of every sample anew, each way, and read frames of the dataset as it is."""
    dataset = open_dataset(source)
    rows = {f"{how}{name}": Row(f"{how}{name}") for how in ("exact, ", "grid, ") for name in _BLOSC}
    rows |= {name: Row(name) for name in (CHOSEN.replace("grid", "exact"), CHOSEN)}
    samples = frames = raw = 0
    for sample in dataset:
        if isinstance(sample, RemeshedSequence):
            continue
        samples, frames, raw = samples + 1, frames + sample.num_frames, raw + sample.positions.nbytes
        for row in rows.values():
            grid = row.name.startswith("grid")
            _add(row, sample.positions, to_grid(sample.positions) if grid else sample.positions)
    first, again = _read_at_random(dataset, reads)
    return Storage(samples, frames, raw, tuple(rows.values()), _on_disk(dataset), first, again)


def _add(row: Row, truth: np.ndarray, positions: np.ndarray) -> None:
    with tempfile.TemporaryDirectory() as folder:
        group = zarr.create_group(zarr.storage.LocalStore(folder))
        begun = time.process_time()
        form = _BLOSC.get(row.name.split(", ", 1)[1])
        if form is None:
            codecs.create_array(group, "positions", positions, ARRAYS["positions"])
        else:
            rows = chunk_rows(positions.shape, positions.itemsize)
            chunk = (rows, *positions.shape[1:])
            shard = (-(-len(positions) // rows) * rows, *positions.shape[1:])
            group.create_array("positions", data=positions, chunks=chunk, shards=shard, **form)
        row.encode += time.process_time() - begun
        with codecs.numcodecs_unremarked():
            array = group["positions"]
        assert isinstance(array, Array)
        begun = time.process_time()
        found = np.asarray(array[...])
        row.decode += time.process_time() - begun
        if not np.array_equal(found, positions):
            raise AssertionError(f"{row.name}: what was read is not what was written")
        moved = np.linalg.norm(found.astype(np.float64) - truth, axis=-1)
        row.error = max(row.error, float(moved.max()))
        row.bytes += sum(p.stat().st_size for p in Path(folder, "positions", "c").rglob("*") if p.is_file())


def _on_disk(dataset: Dataset) -> dict[str, int]:
    sizes: dict[str, int] = {}
    for sample_id in dataset.ids:
        data = dataset.root.read(store.sample_name(sample_id))
        rest = len(data)
        with zipfile.ZipFile(io.BytesIO(data)) as archive:
            for entry in archive.infolist():
                name = "attributes" if entry.filename.endswith("zarr.json") else entry.filename.split("/")[0]
                sizes[name] = sizes.get(name, 0) + entry.file_size
                rest -= entry.file_size
        sizes["archive"] = sizes.get("archive", 0) + rest
    return sizes


def _read_at_random(dataset: Dataset, reads: int) -> tuple[tuple[float, ...], tuple[float, ...]]:
    draw = np.random.default_rng(0)
    lengths = {row["id"]: row["frames"] for row in dataset.rows}
    seen: set[str] = set()
    first: list[float] = []
    again: list[float] = []
    for sample_id in _drawn(draw, dataset.ids, reads):
        frame = int(draw.integers(lengths[sample_id]))
        begun = time.perf_counter()
        dataset.frame(sample_id, frame)
        (again if sample_id in seen else first).append(time.perf_counter() - begun)
        seen.add(sample_id)
    return tuple(first), tuple(again)


def _drawn(draw: np.random.Generator, ids: Sequence[str], reads: int) -> list[str]:
    """Every id once, then `reads` at random."""
    return [*draw.permutation(ids).tolist(), *draw.choice(ids, reads).tolist()]
