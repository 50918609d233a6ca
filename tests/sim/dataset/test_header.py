"""Folders that may not be written to are refused, and nothing in them is touched."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import pytest

from muslin.garments.errors import InputError
from muslin.sim.dataset import durable
from muslin.sim.dataset.header import Header, describe_difference, digest, prepare_root, read_header
from muslin.sim.dataset.local_root import LocalRoot
from muslin.sim.dataset.schema import PARTIAL

HEADER = Header(config={"seed": 0, "scene": {"fabric": "denim"}}, splits={"a": "train", "b": "test"})


def contents(folder: Path) -> dict[str, bytes]:
    return {str(p.relative_to(folder)): p.read_bytes() for p in folder.rglob("*") if p.is_file()}


def test_header_round_trip(tmp_path: Path) -> None:
    prepare_root(LocalRoot(tmp_path), HEADER)
    HEADER.write(LocalRoot(tmp_path))
    assert read_header(LocalRoot(tmp_path)) == HEADER
    assert list(read_header(LocalRoot(tmp_path)).splits) == ["a", "b"]


def test_a_folder_of_something_else_is_left_alone(tmp_path: Path) -> None:
    (tmp_path / "thesis.tex").write_text("chapter 1")
    before = contents(tmp_path)
    with pytest.raises(InputError, match=r"not empty \(thesis\.tex.*empty or new folder"):
        prepare_root(LocalRoot(tmp_path), HEADER)
    assert contents(tmp_path) == before
    assert [p.name for p in tmp_path.iterdir()] == ["thesis.tex"]


def test_a_file_in_the_place_of_the_folder_is_left_alone(tmp_path: Path) -> None:
    file = tmp_path / "data"
    file.write_text("mine")
    with pytest.raises(InputError, match="data: is a file"):
        prepare_root(LocalRoot(file), HEADER)
    assert file.read_text() == "mine"


def test_a_folder_that_cannot_be_made_is_told(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("mine")
    with pytest.raises(InputError, match="file/data: is a file, or would lie in one; choose another place"):
        prepare_root(LocalRoot(tmp_path / "file" / "data"), Header(config={}, splits={}))
    assert (tmp_path / "file").read_text() == "mine"


def test_a_folder_of_a_run_killed_before_its_header_is_taken_up(tmp_path: Path) -> None:
    prepare_root(LocalRoot(tmp_path), HEADER)
    (tmp_path / PARTIAL / "muslin.json.77").write_text("{")
    assert prepare_root(LocalRoot(tmp_path), HEADER) is None


def test_another_config_is_refused_and_the_difference_told(tmp_path: Path) -> None:
    prepare_root(LocalRoot(tmp_path), HEADER)
    HEADER.write(LocalRoot(tmp_path))
    before = contents(tmp_path)
    other = Header(config={"seed": 0, "scene": {"fabric": "silk"}}, splits={"a": "train", "c": "test"})
    with pytest.raises(InputError, match=r"1 of whose 2 samples.*scene\.fabric: denim -> silk"):
        prepare_root(LocalRoot(tmp_path), other)
    assert contents(tmp_path) == before


def test_an_extension_goes_on_in_the_same_folder(tmp_path: Path) -> None:
    prepare_root(LocalRoot(tmp_path), HEADER)
    HEADER.write(LocalRoot(tmp_path))
    longer = replace(HEADER, splits={"z": "train", **HEADER.splits})
    assert prepare_root(LocalRoot(tmp_path), longer) == HEADER


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("{", "not readable as JSON"),
        ("[]", "format must be"),
        ('{"format": "other"}', "format must be 'muslin dataset'"),
        ('{"format": "muslin dataset", "schema_version": "1"}', "not a whole number"),
        ('{"format": "muslin dataset", "schema_version": 3}', "newer than 2.*update muslin"),
        ('{"format": "muslin dataset", "schema_version": 1}', "older than 2.*generate the dataset again"),
        ('{"format": "muslin dataset", "schema_version": 2}', "missing 2 required"),
        ('{"format": "muslin dataset", "schema_version": 2, "config": {}, "splits": {}, "x": 1}', "'x'"),
    ],
)
def test_damaged_and_newer_headers_are_refused(tmp_path: Path, text: str, message: str) -> None:
    (tmp_path / "muslin.json").write_text(text)
    with pytest.raises(InputError, match=message):
        read_header(LocalRoot(tmp_path))
    with pytest.raises(InputError, match=message):
        prepare_root(LocalRoot(tmp_path), HEADER)
    assert [p.name for p in tmp_path.iterdir()] == ["muslin.json"]


def test_no_dataset_at_all(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"muslin\.json is missing"):
        read_header(LocalRoot(tmp_path / "nowhere"))


def test_difference_names_added_removed_and_changed_keys() -> None:
    before = {"a": 1, "b": {"c": [1, 2]}, "d": [{"e": 1}]}
    after = {"b": {"c": [1, 3]}, "d": [{"e": 1}, {"e": 2}], "f": True}
    told = describe_difference(before, after)
    assert told == "a: 1 -> absent, b.c: [1, 2] -> [1, 3], d[1].e: absent -> 2, f: absent -> True"
    assert describe_difference(before, before) == ""


def test_the_digest_ignores_the_order_of_keys_and_nothing_else() -> None:
    assert digest({"a": 1, "b": [1, 2]}) == digest({"b": [1, 2], "a": 1})
    assert digest({"a": [1, 2]}) != digest({"a": [2, 1]})


def test_a_second_writer_is_turned_away(tmp_path: Path) -> None:
    lock = tmp_path / ".lock"
    with durable.exclusive(lock), pytest.raises(InputError, match="another process"), durable.exclusive(lock):
        pass
    with durable.exclusive(lock):
        pass


def test_a_file_is_replaced_whole(tmp_path: Path) -> None:
    file = tmp_path / "x.json"
    for value in range(3):
        durable.write_file(file, json.dumps(value).encode())
        assert json.loads(file.read_bytes()) == value
    assert [p.name for p in tmp_path.iterdir()] == ["x.json"]
