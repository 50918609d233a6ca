"""The file of a sample: the same bytes whenever it is written, read by plain zarr, damage always refused."""

from __future__ import annotations

import io
import os
import random
import time
import zipfile
from collections.abc import Iterable, Iterator
from dataclasses import fields
from pathlib import Path

import numpy as np
import pytest
import zarr
from remeshed_producer import remeshed
from sheet_producer import make_sample
from unpacked import entries_of, replace_file, unpacked

from muslin.garments.errors import InputError
from muslin.sim.dataset import store
from muslin.sim.dataset.packed import PackedStore
from muslin.sim.dataset.reader import Dataset, write_dataset
from muslin.sim.dataset.sample import Sample

FRAMES = 700
"""Of 81 vertices: three chunks a coordinate, which are read apart from each other."""


@pytest.fixture
def dataset(tmp_path: Path) -> Dataset:
    return write_dataset(tmp_path / "data", [make_sample("wave", frames=FRAMES), make_sample("still")])


@pytest.fixture
def still(dataset: Dataset, tmp_path: Path) -> Path:
    return store.sample_file(tmp_path / "data", "still")


def same(a: Sample, b: Sample) -> bool:
    parts = [(getattr(a, name), getattr(b, name)) for name in ("positions", "obstacle_vertices")]
    parts += [(getattr(a.garment, part.name), getattr(b.garment, part.name)) for part in fields(a.garment)]
    equal = all(np.array_equal(x, y) for x, y in parts)
    return equal and (a.certificate, a.scene, a.fabric) == (b.certificate, b.scene, b.fabric)


def refused(dataset: Dataset, sample_id: str, truth: Sample, frames: tuple[int, ...]) -> bool:
    """Whether a damaged sample is refused. Whatever is read of it all the same is what it was."""
    told = []
    for frame in frames:
        try:
            assert np.array_equal(dataset.frame(sample_id, frame), truth.positions[frame])
        except InputError as error:
            told.append(str(error))
    whole = False
    try:
        assert same(store.read_sample(dataset.root, sample_id), truth)
    except InputError as error:
        whole = True
        told.append(str(error))
    assert all(f"{sample_id}.zarr.zip" in text for text in told)
    return whole


def test_the_same_sample_is_the_same_bytes_at_any_time(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    files = []
    for place, shift in (("now", 0.0), ("later", 1e8)):
        monkeypatch.setattr(time, "time", lambda now=time.time, shift=shift: now() + shift)
        write_dataset(tmp_path / place, [make_sample("a", frames=3), remeshed("b")])
        files.append([store.sample_file(tmp_path / place, i).read_bytes() for i in "ab"])
    assert files[0] == files[1]


@pytest.mark.filterwarnings("ignore:Numcodecs codecs are not in")
def test_zarr_itself_opens_it(dataset: Dataset, still: Path) -> None:
    for file in (still, store.sample_file(still.parent.parent, "wave")):
        group = zarr.open_group(zarr.storage.ZipStore(file, mode="r"), mode="r")
        meta, checksums = store.read_meta(dataset.root, group.attrs["meta"]["id"])
        assert group.attrs["meta"] == meta
        assert set(group.array_keys()) == set(checksums)
        for name in checksums:
            np.testing.assert_array_equal(
                group[name][...], store.read_array(dataset.root, group.attrs["meta"]["id"], name)
            )


def test_zip_finds_nothing_wrong_and_every_entry_is_stored_as_it_is(still: Path) -> None:
    with zipfile.ZipFile(still) as archive:
        assert archive.testzip() is None
        assert {entry.compress_type for entry in archive.infolist()} == {zipfile.ZIP_STORED}
        assert archive.namelist()[-1] == "zarr.json"


def test_another_program_may_pack_it_anew_without_compression(dataset: Dataset, still: Path) -> None:
    """Other order, times, extra fields as those of `zip`: the same sample."""
    truth, content, stream = dataset["still"], entries_of(still), io.BytesIO()
    with zipfile.ZipFile(stream, "w") as archive:
        for name in sorted(content, reverse=True):
            entry = zipfile.ZipInfo(name, (2025, 1, 2, 3, 4, 6))
            entry.extra = b"UT\x05\x00\x03abcd"
            archive.writestr(entry, content[name])
    replace_file(still, stream.getvalue())
    assert same(dataset["still"], truth)
    assert np.array_equal(dataset.frame("still", 0), truth.positions[0])


def damage_that_is_found(dataset: Dataset, file: Path, places: Iterable[int]) -> int:
    """How many of these flipped bits change what entries are or hold, each of which must be refused."""
    name, whole, content = f"samples/{file.name}", file.read_bytes(), entries_of(file)
    found = 0
    for bit in places:
        damaged = bytearray(whole)
        damaged[bit // 8] ^= 1 << bit % 8
        replace_file(file, damaged)
        try:
            packed = PackedStore(dataset.root, name)
            read = {key: packed.read(key) for key in content}
        except ValueError:
            found += 1
            continue
        missing = {key for key, data in read.items() if data is None}  # one, where its name was changed
        assert len(missing) <= 1
        assert read == {key: None if key in missing else data for key, data in content.items()}
        found += len(missing)
    replace_file(file, whole)
    return found


def test_no_flipped_bit_gives_an_entry_that_is_not_its_own(dataset: Dataset, still: Path) -> None:
    """Every bit of the list of entries at the end, and one of every ninth byte before it."""
    with zipfile.ZipFile(still) as archive:
        listed, entries = archive.start_dir, archive.infolist()
    end = still.stat().st_size
    spared = sum(30 + len(entry.filename) for entry in entries)  # headers before entries, which none reads
    content = range(0, listed, 9)
    assert damage_that_is_found(dataset, still, (8 * place + place % 8 for place in content)) > 0.8 * (
        len(content) * (listed - spared) / listed
    )
    # Name, sizes, crc32, place, method, signature, lengths and flag of an entry; not its time, mode, version.
    vital = sum(8 * (len(entry.filename) + 4 * 4 + 2 + 4 + 2) for entry in entries)
    assert damage_that_is_found(dataset, still, range(8 * listed, 8 * end)) > vital


@pytest.mark.parametrize("sample_id", ["still", "wave"])
def test_flipped_bits_are_refused_in_one_way_or_change_nothing(
    dataset: Dataset, still: Path, sample_id: str
) -> None:
    """The longer sample is read in parts, each from its place."""
    file, truth, draw = still.with_name(f"{sample_id}.zarr.zip"), dataset[sample_id], random.Random(5)
    whole = file.read_bytes()
    with zipfile.ZipFile(file) as archive:
        listed = archive.start_dir
    assert len(whole) < 1 << 15 if sample_id == "still" else len(whole) > (1 << 15) + 20_000
    frames = tuple(sorted({0, truth.num_frames - 1}))
    count = 0
    for start, stop in ((0, listed), (listed, len(whole))):
        for _ in range(40):
            damaged = bytearray(whole)
            damaged[draw.randrange(start, stop)] ^= 1 << draw.randrange(8)
            replace_file(file, damaged)
            count += refused(dataset, sample_id, truth, frames)
    assert count > 40
    replace_file(file, whole)
    assert not refused(dataset, sample_id, truth, frames)


def cuts(size: int) -> Iterator[int]:
    """Lengths to cut a file to: some of all, and each of the last ones."""
    yield from range(0, size, max(1, size // 100))
    yield from range(size - 30, size)


def test_a_file_that_is_cut_anywhere_is_refused(dataset: Dataset, still: Path) -> None:
    whole = still.read_bytes()
    for length in cuts(len(whole)):
        replace_file(still, whole[:length])
        for read in (lambda: dataset["still"], lambda: dataset.frame("still", 0)):
            with pytest.raises(InputError, match=r"still\.zarr\.zip: not readable.*muslin repair"):
                read()


def test_a_file_that_is_cut_while_it_is_open_gives_no_wrong_frame(dataset: Dataset, still: Path) -> None:
    file, truth = store.sample_file(still.parent.parent, "wave"), dataset["wave"].positions
    whole, status = file.read_bytes(), file.stat()
    dataset.frame("wave", 0)
    os.truncate(file, len(whole) // 3)
    refused = 0
    for frame in range(0, FRAMES, 50):
        try:
            assert np.array_equal(dataset.frame("wave", frame), truth[frame])
        except InputError:
            refused += 1
    assert refused
    file.write_bytes(whole)
    os.utime(file, ns=(status.st_atime_ns, status.st_mtime_ns))
    assert np.array_equal(dataset.frame("wave", 0), truth[0])


@pytest.mark.parametrize("data", [b"", b"PK", b"no archive at all", bytes(100_000), b"PK\5\6" + bytes(18)])
def test_what_is_no_archive_is_refused(dataset: Dataset, still: Path, data: bytes) -> None:
    replace_file(still, data)
    for read in (lambda: dataset["still"], lambda: dataset.frame("still", 0)):
        with pytest.raises(InputError, match=r"still\.zarr\.zip.*not readable.*muslin repair"):
            read()


def test_a_folder_in_the_place_of_the_file_is_refused(dataset: Dataset, still: Path) -> None:
    still.unlink()
    still.mkdir()
    with pytest.raises(InputError, match=r"still\.zarr\.zip: not readable"):
        dataset.frame("still", 0)


@pytest.mark.parametrize("method", [zipfile.ZIP_DEFLATED, zipfile.ZIP_LZMA])
def test_a_compressed_entry_is_refused_by_name(dataset: Dataset, still: Path, method: int) -> None:
    content, stream = entries_of(still), io.BytesIO()
    with zipfile.ZipFile(stream, "w") as archive:
        for name, data in content.items():
            archive.writestr(name, data, method if name == "uv/zarr.json" else zipfile.ZIP_STORED)
    replace_file(still, stream.getvalue())
    for read in (lambda: dataset["still"], lambda: dataset.frame("still", 0)):
        with pytest.raises(InputError, match=r"still\.zarr\.zip: .*uv/zarr\.json is compressed.*repair"):
            read()


def test_an_entry_that_is_there_twice_is_refused(dataset: Dataset, still: Path) -> None:
    with zipfile.ZipFile(still, "a") as archive, pytest.warns(UserWarning, match="Duplicate name"):
        archive.writestr("uv/zarr.json", b"{}")
    with pytest.raises(InputError, match=r"does not fit them at uv/zarr\.json"):
        dataset.frame("still", 0)


def test_any_entry_that_is_missing_is_told(dataset: Dataset, still: Path) -> None:
    whole = still.read_bytes()
    for name in entries_of(still):
        with unpacked(still) as folder:
            (folder / name).unlink()
        with pytest.raises(InputError, match=r"still\.zarr\.zip/.*muslin repair"):
            store.read_sample(dataset.root, "still")
        if name.startswith("positions/") or name == "zarr.json":
            with pytest.raises(InputError, match=r"still\.zarr\.zip/.*muslin repair"):
                dataset.frame("still", 0)
        replace_file(still, whole)


@pytest.mark.parametrize("text", ["null", "[]", "7", '"zarr"', "{}", '{"zarr_format": 3}', "{", "\xff", ""])
def test_metadata_that_are_none_are_refused(dataset: Dataset, still: Path, text: str) -> None:
    """In an archive without fault, so that nothing but the metadata tells."""
    whole = still.read_bytes()
    for name in ("zarr.json", "positions/zarr.json"):
        with unpacked(still) as folder:
            (folder / name).write_bytes(text.encode("latin-1"))
        for read in (lambda: dataset["still"], lambda: dataset.frame("still", 0)):
            with pytest.raises(InputError, match=r"still\.zarr\.zip/.*muslin repair"):
                read()
        replace_file(still, whole)


def test_a_chunk_shape_of_zero_is_refused(dataset: Dataset, still: Path) -> None:
    with unpacked(still) as folder:
        file = folder / "faces" / "zarr.json"
        text = file.read_text().replace('"chunk_shape": [', '"chunk_shape": [0, ', 1)
        assert text != file.read_text()
        file.write_text(text)
    with pytest.raises(InputError, match=r"still\.zarr\.zip/faces: not readable"):
        store.read_sample(dataset.root, "still")
