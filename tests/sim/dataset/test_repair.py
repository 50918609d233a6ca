"""What is damaged is found, set aside and made again to the same bytes; what cannot be is not touched."""

from __future__ import annotations

import random
import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from sheet_producer import files_of, make_scene, sheets_config, simulate
from unpacked import chunk_of, replace_file, unpacked

from muslin.garments.errors import InputError
from muslin.sim.dataset import store
from muslin.sim.dataset.config import parse_config
from muslin.sim.dataset.generate import generate
from muslin.sim.dataset.info import info
from muslin.sim.dataset.reader import open_dataset
from muslin.sim.dataset.repair import RepairReport, repair
from muslin.sim.dataset.root import open_root
from muslin.sim.dataset.sample import BodyTrack
from muslin.sim.dataset.schema import FAILED, INDEX, SAMPLES
from muslin.sim.dataset.verify import verify


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Two chains of four drapes and a sequence, undisturbed."""
    out = tmp_path_factory.mktemp("whole") / "data"
    generate(sheets_config(), out, workers=1, simulate=simulate, make_scene=make_scene)
    return out


@pytest.fixture
def data(whole: Path, tmp_path: Path) -> Path:
    return shutil.copytree(whole, tmp_path / "data")


def mend(root: Path, dry: bool = False) -> RepairReport:
    return repair(root, workers=1, dry=dry, simulate=simulate, make_scene=make_scene)


def flip_a_bit(file: Path, bit: int) -> None:
    data = bytearray(file.read_bytes())
    data[bit // 8] ^= 1 << bit % 8
    replace_file(file, data)


def flip_in_a_chunk(sample: Path) -> None:
    with unpacked(sample) as folder:
        chunk = chunk_of(folder, "positions")
        flip_a_bit(chunk, 4 * chunk.stat().st_size)


def truncate_attributes(sample: Path) -> None:
    with unpacked(sample) as folder:
        file = folder / "zarr.json"
        file.write_bytes(file.read_bytes()[: file.stat().st_size // 2])


def empty_a_chunk(sample: Path) -> None:
    with unpacked(sample) as folder:
        chunk_of(folder, "positions").write_bytes(b"")


def delete_an_array(sample: Path) -> None:
    with unpacked(sample) as folder:
        shutil.rmtree(folder / "uv")


def delete_a_chunk(sample: Path) -> None:
    with unpacked(sample) as folder:
        shutil.rmtree(folder / "positions" / "c")


def make_it_no_archive(sample: Path) -> None:
    sample.write_bytes(b"not a sample")


def cut_it(sample: Path) -> None:
    sample.write_bytes(sample.read_bytes()[: sample.stat().st_size // 2])


def empty_it(sample: Path) -> None:
    sample.write_bytes(b"")


# By place: the start, the middle and the end of a chain of four, most of another, and the sequence.
DAMAGES = {
    0: truncate_attributes,
    2: flip_in_a_chunk,
    3: delete_an_array,
    4: cut_it,
    5: empty_a_chunk,
    6: make_it_no_archive,
    7: empty_it,
    8: delete_a_chunk,
}


def assert_same(root: Path, whole: Path) -> None:
    assert files_of(root) == files_of(whole)
    assert info(root).geometry_sha256 == info(whole).geometry_sha256
    # `bytes` counts the digits of the seconds.
    kept = [
        [{key: row[key] for key in row if key not in ("seconds", "bytes")} for row in open_dataset(path).rows]
        for path in (root, whole)
    ]
    assert kept[0] == kept[1]


def test_damaged_samples_are_set_aside_and_made_again(whole: Path, data: Path) -> None:
    ids = open_dataset(data).ids
    names = tuple(ids[place] for place in DAMAGES)
    for place, damage in DAMAGES.items():
        damage(store.sample_file(data, ids[place]))
    stamps = {name: store.sample_file(data, name).stat().st_mtime_ns for name in set(ids) - set(names)}
    listed = mend(data, dry=True)
    assert tuple(listed.damaged) == names
    assert not listed.passed
    assert not (data / FAILED).exists()
    report = mend(data)
    assert report.passed
    assert (report.made, tuple(report.damaged), report.failed) == (names, names, {})
    assert report.aside == {name: str(data / FAILED / f"{name}.zarr.zip-1") for name in names}
    assert all(Path(place).is_file() for place in report.aside.values())
    assert_same(data, whole)
    assert stamps == {name: store.sample_file(data, name).stat().st_mtime_ns for name in stamps}
    assert mend(data) == RepairReport(checked=9, damaged={})


def test_nothing_set_aside_is_ever_replaced(whole: Path, data: Path) -> None:
    name = open_dataset(data).ids[0]
    stranger = data / FAILED / f"{name}.zarr.zip-2"
    stranger.parent.mkdir()
    stranger.write_bytes(b"mine")
    for place in ("1", "3"):
        flip_in_a_chunk(store.sample_file(data, name))
        damaged = store.sample_file(data, name).read_bytes()
        (aside,) = mend(data).aside.values()
        assert aside == str(data / FAILED / f"{name}.zarr.zip-{place}")
        assert Path(aside).read_bytes() == damaged
    assert stranger.read_bytes() == b"mine"
    assert_same(data, whole)
    assert verify(data, workers=1).samples == info(data).samples == 9, "what is set aside is no sample"


def test_missing_samples_and_a_damaged_index_are_made_too(whole: Path, data: Path) -> None:
    (data / INDEX).write_bytes(b"no parquet")
    assert not mend(data, dry=True).passed
    report = mend(data)
    assert report.index.startswith(str(data / INDEX))
    assert (report.made, report.passed) == ((), True)
    assert_same(data, whole)
    gone = open_dataset(data).ids[5]
    store.sample_file(data, gone).unlink()
    assert mend(data).made == (gone,), "listed in the index"
    (data / INDEX).unlink()
    shutil.rmtree(data / SAMPLES)
    report = mend(data)
    assert report.missing == report.made == open_dataset(whole).ids
    assert_same(data, whole)


def test_a_sample_that_intersects_is_made_again(whole: Path, data: Path) -> None:
    """Its bytes match their checksum: only its geometry tells."""
    name = open_dataset(data).ids[4]
    sample = store.read_sample(open_root(data), name)
    sample.positions[:, :, 1] = 0.1
    store.sample_file(data, name).unlink()
    store.write_sample(open_root(data), sample)
    report = mend(data)
    assert "cloth-body intersections" in report.damaged[name]
    assert report.made == (name,)
    assert_same(data, whole)


def other_simulate(*arguments: object) -> object:
    return simulate(*arguments)  # type: ignore[arg-type]


@pytest.mark.parametrize("how_many", [1, 9])
def test_what_another_solver_made_is_refused_before_anything_is_moved(data: Path, how_many: int) -> None:
    for name in open_dataset(data).ids[:how_many]:
        flip_in_a_chunk(store.sample_file(data, name))
    before = {file: file.read_bytes() for file in data.rglob("*") if file.is_file()}
    with pytest.raises(InputError, match=r"another solver.*install what made them"):
        repair(data, workers=1, simulate=other_simulate, make_scene=make_scene)  # type: ignore[arg-type]
    assert before == {file: file.read_bytes() for file in data.rglob("*") if file.is_file()}


def test_a_damaged_sample_that_no_config_plans_is_refused(data: Path) -> None:
    extra = store.sample_file(data, "extra")
    shutil.copy(store.sample_file(data, open_dataset(data).ids[0]), extra)
    flip_in_a_chunk(store.sample_file(data, open_dataset(data).ids[0]))
    with pytest.raises(InputError, match=r"extra: not planned by the dataset's config"):
        mend(data)
    assert not (data / FAILED).exists()


def test_what_cannot_be_made_again_is_told(tmp_path: Path) -> None:
    """A producer that makes the same wrong sample again: set aside, made, and still wrong."""
    root = tmp_path / "data"
    generate(sheets_config(), root, workers=1, simulate=sunk, make_scene=make_scene)
    name = open_dataset(root).ids[0]
    report = repair(root, workers=1, simulate=sunk, make_scene=make_scene)
    assert not report.passed
    assert tuple(report.failed) == tuple(report.damaged) == report.made == (name,)
    assert len(open_dataset(root)) == 9


def test_samples_of_another_body_file_are_not_taken_for_damaged(tmp_path: Path) -> None:
    root = tmp_path / "data"
    generate(
        parse_config({"kind": "drape"}), root, workers=1, simulate=worn_by_another, make_scene=make_scene
    )
    (name,) = open_dataset(root).ids
    assert "has digest" in verify(root, workers=1).failed[name]
    with pytest.raises(InputError, match="put the file back that they were made with"):
        repair(root, workers=1, simulate=worn_by_another, make_scene=make_scene)
    assert store.sample_file(root, name).exists()


def worn_by_another(scenes, device, progress):  # type: ignore[no-untyped-def]
    """A sheet above a body that the file of its name does not hold any more."""
    track = BodyTrack("female", "0" * 64, np.zeros(10), np.zeros((1, 24, 3)), np.zeros((1, 3)))
    for sample in simulate(scenes, device, progress):
        yield replace(sample, body=track, obstacle_vertices=None, obstacle_faces=None)


def sunk(scenes, device, progress):  # type: ignore[no-untyped-def]
    """The sheets, but the first of all lies in the ball."""
    for scene, sample in zip(scenes, simulate(scenes, device, progress), strict=True):
        if scene.get("body", {}).get("beta") == [-1.0]:
            sample.positions[:, :, 1] = 0.1
        yield sample


def test_no_flipped_bit_escapes_or_stops_verification(data: Path) -> None:
    """Bits drawn at random, of an entry that is packed again, or of the file: the sample fails, or holds what
    it held."""
    name = open_dataset(data).ids[4]
    root, file = open_root(data), store.sample_file(data, name)
    known, whole = store.read_sample(root, name), file.read_bytes()
    draw = random.Random(7)
    found = 0
    for entry in [True] * 60 + [False] * 20:
        if entry:
            with unpacked(file) as folder:
                chosen = draw.choice(sorted(path for path in folder.rglob("*") if path.is_file()))
                flip_a_bit(chosen, draw.randrange(8 * chosen.stat().st_size))
        else:
            flip_a_bit(file, draw.randrange(8 * len(whole)))
        report = verify(data, ids=[name], workers=1)
        found += not report.passed
        if report.passed:
            sample = store.read_sample(root, name)
            assert np.array_equal(sample.positions, known.positions)
            assert sample.certificate == known.certificate
        replace_file(file, whole)
    assert found > 20
    assert verify(data, ids=[name], workers=1).passed
