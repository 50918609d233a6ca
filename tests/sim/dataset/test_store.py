"""What is written comes back bit for bit; what is damaged is refused by name."""

from __future__ import annotations

import errno
import json
import os
from dataclasses import fields, replace
from pathlib import Path

import numpy as np
import pytest
from sheet_producer import make_sample
from unpacked import chunk_of, entries_of, replace_file, unpacked

from muslin.garments.errors import InputError
from muslin.sim.dataset import durable, store
from muslin.sim.dataset.certificate import Certificate
from muslin.sim.dataset.header import Header, digest, prepare_root
from muslin.sim.dataset.local_root import LocalRoot
from muslin.sim.dataset.sample import BodyTrack
from muslin.sim.dataset.schema import ARRAYS, CHUNK_BYTES, PARTIAL, chunk_rows


@pytest.fixture
def root(tmp_path: Path) -> LocalRoot:
    place = LocalRoot(tmp_path / "data")
    prepare_root(place, Header(config={}, splits={"sheet": "train"}))
    return place


def file_of(root: LocalRoot) -> Path:
    return store.sample_file(root.path, "sheet")


def test_every_field_survives_the_round_trip_bit_for_bit(root: LocalRoot) -> None:
    masked = tuple(np.arange(k, dtype=np.int32) for k in (3, 0, 5))
    written = replace(
        make_sample(frames=3),
        masked_faces=masked,
        seed=7,
        labels={"design": "sheet", "shape": "mean"},
        certificate=Certificate(
            0, 0, 1e-3, 5, 0.02, 0.1, 7, "abc", 1.5, {"numpy": "2"}, {"iterations": [1, 2]}
        ),
    )
    stored = store.write_sample(root, written)
    assert stored.new
    assert (stored.meta, stored.checksums) == store.read_meta(root, "sheet")
    assert stored.size == store.stored_bytes(root, "sheet") == file_of(root).stat().st_size
    read = store.read_sample(root, "sheet")
    for entry in fields(written):
        a, b = getattr(written, entry.name), getattr(read, entry.name)
        if isinstance(a, np.ndarray):
            assert a.dtype == b.dtype
            assert a.tobytes() == b.tobytes()
        elif entry.name == "garment":
            for part in fields(a):
                np.testing.assert_array_equal(getattr(a, part.name), getattr(b, part.name))
        elif entry.name == "masked_faces":
            assert [m.tolist() for m in a] == [m.tolist() for m in b]
            assert all(m.dtype == np.int32 for m in b)
        else:
            assert a == b
    np.testing.assert_array_equal(read.times, [0.0, 1 / 30, 2 / 30])


def test_body_track_keeps_float64(root: LocalRoot) -> None:
    draw = np.random.default_rng(0)
    track = BodyTrack(
        "female", "d", draw.normal(size=10), draw.normal(size=(1, 24, 3)), draw.normal(size=(1, 3))
    )
    sample = replace(make_sample(), body=track, obstacle_vertices=None, obstacle_faces=None)
    store.write_sample(root, sample)
    read = store.read_sample(root, "sheet").body
    assert read is not None
    for name in ("beta", "poses", "translations"):
        assert getattr(read, name).tobytes() == getattr(track, name).tobytes()


def test_masks_that_are_all_empty_stay_empty(root: LocalRoot) -> None:
    none = tuple(np.zeros(0, dtype=np.int32) for _ in range(2))
    store.write_sample(root, replace(make_sample(frames=2), masked_faces=none))
    assert [len(m) for m in store.read_sample(root, "sheet").masked_faces] == [0, 0]


def test_a_long_sequence_is_one_shard_of_many_chunks(root: LocalRoot) -> None:
    sample = make_sample(frames=1500)
    assert chunk_rows(sample.positions.shape, 4) == CHUNK_BYTES // (81 * 12)
    store.write_sample(root, sample)
    found = [name for name in entries_of(file_of(root)) if name.startswith("positions/c/")]
    assert found == ["positions/c/0/0/0"]
    np.testing.assert_array_equal(store.read_array(root, "sheet", "positions"), sample.positions)


def test_the_first_commit_wins(root: LocalRoot) -> None:
    first = make_sample()
    assert store.write_sample(root, first).new
    assert not store.write_sample(root, make_sample(clearance=0.5)).new
    np.testing.assert_array_equal(store.read_sample(root, "sheet").positions, first.positions)
    assert not list((root.path / PARTIAL).iterdir())


def test_partial_samples_are_not_samples_and_are_cleaned(root: LocalRoot) -> None:
    half = root.path / PARTIAL / "samples-sheet.zarr.zip.123"
    half.write_bytes(b"PK\3\4")
    torn = root.path / PARTIAL / "index.parquet.123"
    torn.write_bytes(b"PAR1")
    assert store.stored_ids(root) == []
    root.clean()
    assert not half.exists()
    assert not torn.exists()


def test_a_write_that_fails_leaves_nothing_behind(root: LocalRoot, monkeypatch: pytest.MonkeyPatch) -> None:
    def full(handle: int) -> None:
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.delenv(durable.NO_SYNC, raising=False)
    monkeypatch.setattr(os, "fsync", full)
    with pytest.raises(OSError, match="No space left"):
        store.write_sample(root, make_sample())
    assert store.stored_ids(root) == []
    assert not list((root.path / PARTIAL).iterdir())


@pytest.mark.parametrize(("asked", "waits"), [(None, True), ("0", True), ("1", False)])
def test_samples_wait_for_the_disk_unless_told_not_to(
    root: LocalRoot, monkeypatch: pytest.MonkeyPatch, asked: str | None, waits: bool
) -> None:
    waited: list[int] = []
    monkeypatch.setattr(os, "fsync", waited.append)
    monkeypatch.delenv(durable.NO_SYNC, raising=False)
    if asked is not None:
        monkeypatch.setenv(durable.NO_SYNC, asked)
    assert store.write_sample(root, make_sample()).new
    assert bool(waited) == waits
    assert store.stored_ids(root) == ["sheet"]


@pytest.mark.parametrize("name", ["positions", "faces", "panel_vertices", "obstacle_vertices"])
@pytest.mark.parametrize("damage", ["flip", "truncate", "remove"])
def test_a_damaged_chunk_is_named_with_a_remedy(root: LocalRoot, name: str, damage: str) -> None:
    store.write_sample(root, make_sample(frames=2))
    with unpacked(file_of(root)) as folder:
        chunk = chunk_of(folder, name)
        data = bytearray(chunk.read_bytes())
        data[len(data) // 2] ^= 0x10
        match damage:
            case "flip":
                chunk.write_bytes(data)
            case "truncate":
                chunk.write_bytes(data[: len(data) // 2])
            case "remove":
                chunk.unlink()
    with pytest.raises(InputError, match=rf"sheet\.zarr\.zip/{name}: .*muslin repair"):
        store.read_sample(root, "sheet")


def test_damaged_attributes_are_refused(root: LocalRoot) -> None:
    store.write_sample(root, make_sample())
    whole = file_of(root).read_bytes()
    for damage, message in (
        (
            lambda file: file.write_text(file.read_text().replace('"paper"', '"denim"')),
            "not match their check",
        ),
        (lambda file: file.write_text(file.read_text().replace("0.02", "NaN")), "not match their checksum"),
        (lambda file: file.write_text(file.read_text()[:200]), r"zarr\.json: not readable"),
        (lambda file: file.unlink(), r"zarr\.json: not readable"),
    ):
        with unpacked(file_of(root)) as folder:
            damage(folder / "zarr.json")
        with pytest.raises(InputError, match=message):
            store.read_sample(root, "sheet")
        replace_file(file_of(root), whole)


def test_a_sample_of_a_newer_schema_is_refused(root: LocalRoot) -> None:
    store.write_sample(root, make_sample())
    with unpacked(file_of(root)) as folder:
        file = folder / "zarr.json"
        values = json.loads(file.read_text())
        values["attributes"]["meta"]["schema_version"] = 3
        values["attributes"]["meta_sha256"] = digest(values["attributes"]["meta"])
        file.write_text(json.dumps(values))
    with pytest.raises(InputError, match=r"newer than 2.*update muslin"):
        store.read_sample(root, "sheet")


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf])
def test_what_cannot_be_is_never_written(root: LocalRoot, value: float) -> None:
    sample = make_sample()
    positions = sample.positions.copy()
    positions[0, 4, 1] = value
    with pytest.raises(InputError, match="sheet: NaN or infinity in positions"):
        store.write_sample(root, replace(sample, positions=positions))
    assert store.stored_ids(root) == []
    assert not list((root.path / PARTIAL).iterdir())


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"id": "../up"}, "letters, digits"),
        ({"id": ""}, "letters, digits"),
        ({"kind": "video"}, "'drape' or 'sequence'"),
        ({"kind": "sequence"}, "fps = None"),
        ({"positions": np.zeros((1, 80, 3), np.float32)}, r"positions of shape \(1, 80, 3\)"),
        ({"positions": np.zeros((1, 81, 3))}, "float64.*float32"),
        ({"positions": np.zeros((0, 81, 3), np.float32)}, "0 frames"),
        ({"masked_faces": (np.zeros(1, np.int32),) * 2}, "2 frames of masked_faces"),
        ({"obstacle_faces": None}, "given together"),
        ({"obstacle_faces": np.full((1, 3), 10_000, np.int32)}, "an index in obstacle_faces"),
        ({"certificate": Certificate(min_distance_m=float("nan"))}, "min_distance_m = nan"),
    ],
)
def test_validation_names_what_is_wrong(root: LocalRoot, change: dict, message: str) -> None:
    with pytest.raises(InputError, match=message):
        store.write_sample(root, replace(make_sample(), **change))
    assert store.stored_ids(root) == []


def test_certificates_keep_keys_of_other_versions() -> None:
    values = Certificate(seed=3).to_dict() | {"colour": "red"}
    assert Certificate.from_dict(values).extra == {"colour": "red"}


def test_every_array_of_the_schema_is_documented() -> None:
    assert all(spec.meaning and np.dtype(spec.dtype) for spec in ARRAYS.values())
