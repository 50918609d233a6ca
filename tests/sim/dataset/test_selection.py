"""Part of a dataset is what was asked for, or an error that says what there is."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest
from sheet_producer import make_sample

from muslin.garments.errors import InputError
from muslin.sim.dataset.reader import Dataset, write_dataset
from muslin.sim.dataset.selection import select


@pytest.fixture(scope="module")
def dataset(tmp_path_factory: pytest.TempPathFactory) -> Dataset:
    labels = [{"split": "train", "design": "a"}, {"split": "test", "design": "a"}, {"split": "train"}]
    samples = [
        replace(make_sample(name, frames=frames), labels=given)
        for name, frames, given in zip("xyz", (1, 3, 3), labels, strict=True)
    ]
    return write_dataset(tmp_path_factory.mktemp("select") / "data", samples)


def test_all_conditions_hold(dataset: Dataset) -> None:
    assert select(dataset).ids == ("x", "y", "z")
    assert select(str(dataset.root), "train").ids == ("x", "z")
    assert select(dataset, where={"frames": 3}).ids == ("y", "z")
    assert select(dataset, where={"frames": "3", "design": "a"}).ids == ("y",)
    assert select(dataset, where={"design": "a*"}).ids == select(dataset, where={"design": "a"}).ids
    assert select(dataset, ids=["z", "x", "z"]).ids == ("z", "x")
    assert select(dataset, "test", {"design": "a"}, ["z", "y"]).ids == ("y",)


@pytest.mark.parametrize(
    ("asked", "message"),
    [
        ({"split": "tests"}, "has no split 'tests'; it has train, test"),
        ({"where": {"colour": "red"}}, "samples have no 'colour'; they have body, bytes"),
        ({"where": {"frames": "many"}}, "no sample has frames=many; there is 1, 3"),
        ({"split": "test", "where": {"frames": 1}}, "no sample has frames=1; there is 3"),
        ({"ids": ["w"]}, "no sample 'w'"),
    ],
)
def test_what_is_not_there_is_told(dataset: Dataset, asked: dict, message: str) -> None:
    with pytest.raises(InputError, match=message):
        select(dataset, **asked)


def test_a_dataset_without_samples(tmp_path: Path) -> None:
    empty = write_dataset(tmp_path / "empty", [])
    with pytest.raises(InputError, match="holds no sample"):
        select(empty, "train")
