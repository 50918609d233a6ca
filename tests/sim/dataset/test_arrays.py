"""Plain arrays are the sample's own, whole or frame by frame."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from remeshed_producer import FRAME_TOPOLOGY, remeshed
from sheet_producer import make_sample

from muslin.sim.body import load_body
from muslin.sim.dataset.arrays import load_frames, load_samples
from muslin.sim.dataset.reader import Dataset, write_dataset
from muslin.sim.dataset.sample import BodyTrack
from muslin.sim.dataset.schema import GARMENT_ARRAYS

FRAMES = 3


@pytest.fixture(scope="module")
def dataset(tmp_path_factory: pytest.TempPathFactory) -> Dataset:
    generator = np.random.default_rng(0)
    track = BodyTrack(
        model="neutral",
        digest=load_body("neutral").digest,
        beta=np.array([0.5, -1.0]),
        poses=0.1 * generator.standard_normal((FRAMES, 24, 3)),
        translations=generator.standard_normal((FRAMES, 3)),
    )
    worn = replace(
        make_sample("worn", frames=FRAMES), body=track, obstacle_vertices=None, obstacle_faces=None
    )
    drape = replace(make_sample("drape"), labels={"split": "train", "design": "sheet", "shape": "ball"})
    return write_dataset(tmp_path_factory.mktemp("arrays") / "data", [drape, worn, remeshed("sway")])


def test_whole_samples(dataset: Dataset) -> None:
    drape, worn, _ = load_samples(dataset, body=True)
    facts = ("sample", "split", "kind", "design", "shape", "sequence", "fabric", "fps")
    assert [drape[key] for key in facts] == ["drape", "train", "drape", "sheet", "ball", "", "paper", 0.0]
    sample = dataset["worn"]
    assert sample.body is not None
    np.testing.assert_array_equal(worn["positions"], sample.positions)
    for name in GARMENT_ARRAYS:
        np.testing.assert_array_equal(worn[name], getattr(sample.garment, name))
    for name in ("beta", "poses", "translations"):
        np.testing.assert_array_equal(worn[name], getattr(sample.body, name))
    np.testing.assert_array_equal(worn["body_vertices"][2], sample.body_vertices(2).astype(np.float32))
    np.testing.assert_array_equal(drape["body_faces"], dataset["drape"].body_faces)
    assert "beta" not in drape
    assert "body_vertices" not in next(load_samples(dataset))


def test_frames_are_those_of_the_samples_once_each(dataset: Dataset) -> None:
    frames = list(load_frames(dataset, body=True))
    told = [(frame["sample"], frame["frame"]) for frame in frames]
    assert told == [(sample.id, t) for sample in dataset for t in range(sample.num_frames)]
    for frame in frames:
        sample, t = dataset[frame["sample"]], frame["frame"]
        np.testing.assert_array_equal(frame["positions"], sample.frame_positions(t))
        np.testing.assert_array_equal(frame["faces"], sample.frame_garment(t).faces)
        np.testing.assert_array_equal(frame["body_vertices"], sample.body_vertices(t).astype(np.float32))
        if sample.body is not None:
            np.testing.assert_array_equal(frame["pose"], sample.body.poses[t])
            np.testing.assert_array_equal(frame["translation"], sample.body.translations[t])


def test_changing_topology_is_one_entry_a_frame(dataset: Dataset) -> None:
    (sway,) = load_samples(dataset, where={"id": "sway"})
    sample = dataset["sway"]
    for t in range(len(FRAME_TOPOLOGY)):
        np.testing.assert_array_equal(sway["positions"][t], sample.frame_positions(t))
        for name in GARMENT_ARRAYS:
            np.testing.assert_array_equal(sway[name][t], getattr(sample.frame_garment(t), name))
    assert sway["faces"][0].shape != sway["faces"][2].shape
