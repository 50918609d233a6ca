"""Datasets open by folder, give samples by id, place and split, and are summed up truly."""

from __future__ import annotations

import pickle
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from sheet_producer import make_sample

from muslin.garments.errors import InputError
from muslin.sim.dataset import store
from muslin.sim.dataset.certificate import Certificate
from muslin.sim.dataset.info import info
from muslin.sim.dataset.reader import Dataset, open_dataset, write_dataset
from muslin.sim.dataset.schema import INDEX


@pytest.fixture(scope="module")
def dataset(tmp_path_factory: pytest.TempPathFactory) -> Dataset:
    samples = [
        replace(
            make_sample("b", frames=4),
            labels={"split": "test", "design": "sheet", "sequence": "wave"},
            certificate=Certificate(0, 0, 2e-3, 3, None, 0.3, seconds=2.0),
        ),
        replace(
            make_sample("a"),
            labels={"split": "train", "design": "sheet", "shape": "mean"},
            certificate=Certificate(0, 0, 1e-3, 1, 0.01, 0.1, seconds=3.0),
        ),
    ]
    return write_dataset(tmp_path_factory.mktemp("reader") / "data", samples, {"name": "two"})


def test_samples_by_id_place_and_split(dataset: Dataset) -> None:
    assert (len(dataset), dataset.ids, dataset.splits) == (2, ("b", "a"), ("test", "train"))
    assert "a" in dataset
    assert "c" not in dataset
    assert [sample.id for sample in dataset] == ["b", "a"]
    assert dataset[1].id == dataset["a"].id == "a"
    assert dataset["a"].labels["split"] == "train"
    np.testing.assert_array_equal(dataset["b"].positions, make_sample(frames=4).positions)
    assert dataset.split("test").ids == ("b",)
    assert dataset.where(kind="drape").ids == ("a",)
    with pytest.raises(InputError, match="no split 'valid'; it has test, train"):
        dataset.split("valid")
    with pytest.raises(InputError, match="no sample 'aa'; it has a"):
        dataset["aa"]


def test_a_dataset_can_be_handed_to_other_processes(dataset: Dataset) -> None:
    assert pickle.loads(pickle.dumps(dataset))["a"].id == "a"


def test_summary(dataset: Dataset) -> None:
    summary = info(dataset.root)
    assert (summary.name, summary.samples, summary.drapes, summary.sequences_made) == ("two", 2, 1, 1)
    assert (summary.frames, summary.vertices, summary.seconds) == (5, (81, 81), 5.0)
    assert summary.splits == {"test": 1, "train": 1}
    assert summary.designs == {"sheet": 2}
    assert summary.sequences == {"wave": 1}
    assert summary.certificates["min_distance_m"] == 1e-3
    assert summary.certificates["largest_strain"] == 0.3
    assert summary.certificates["masked_body_faces_max"] == 3
    assert summary.certificates["force_residual"] == 0.01
    assert summary.unmeasured == {"force_residual": 1}
    on_disk = sum(p.stat().st_size for p in (dataset.root.path / "samples").iterdir())
    assert summary.bytes == on_disk
    assert summary.to_dict()["geometry_sha256"] == summary.geometry_sha256


def test_the_digest_of_the_geometry_tells_one_bit(dataset: Dataset, tmp_path: Path) -> None:
    samples = list(dataset)
    positions = samples[0].positions.copy()
    positions[0, 0, 0] = np.nextafter(positions[0, 0, 0], np.float32(1))
    one_bit = [replace(samples[0], positions=positions), samples[1]]
    slower = [replace(sample, certificate=replace(sample.certificate, seconds=99.0)) for sample in samples]
    of = info(dataset.root).geometry_sha256
    assert info(write_dataset(tmp_path / "one", one_bit).root).geometry_sha256 != of
    assert info(write_dataset(tmp_path / "two", slower).root).geometry_sha256 == of


def test_a_damaged_index_is_named(tmp_path: Path) -> None:
    made = write_dataset(tmp_path / "data", [make_sample()])
    (made.root.path / INDEX).write_bytes(b"PAR1")
    with pytest.raises(InputError, match=r"index\.parquet: not readable.*rebuilt"):
        open_dataset(made.root)


def test_nothing_is_written_over(tmp_path: Path) -> None:
    root = write_dataset(tmp_path / "data", [make_sample()]).root
    before = store.geometry_digest(store.read_meta(root, "sheet")[1])
    with pytest.raises(InputError, match="holds a sample 'sheet' already"):
        write_dataset(tmp_path / "data", [make_sample(clearance=0.3)])
    assert store.geometry_digest(store.read_meta(root, "sheet")[1]) == before
    with pytest.raises(InputError, match="two of the samples have the same id"):
        write_dataset(tmp_path / "other", [make_sample(), make_sample()])
