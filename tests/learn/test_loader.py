"""Every frame of a dataset, exactly once, as it is stored, whatever reads it."""

from __future__ import annotations

import pickle
import shutil
from collections import Counter
from collections.abc import Iterable
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from remeshed_producer import remeshed
from sheet_producer import make_sample

torch = pytest.importorskip("torch", reason="torch is not installed; pip install 'muslin[learn]'")

from torch.utils.data import DataLoader

from muslin.garments.errors import InputError
from muslin.learn.collate import collate
from muslin.learn.loader import FrameDataset, FrameStream
from muslin.sim.dataset.arrays import load_frames
from muslin.sim.dataset.reader import Dataset, write_dataset
from muslin.sim.dataset.schema import GARMENT_ARRAYS

LENGTHS = (1, 4, 2, 1, 5, 3)


@pytest.fixture(scope="module")
def dataset(tmp_path_factory: pytest.TempPathFactory) -> Dataset:
    samples = [make_sample(f"s{k}", frames=n, phase=0.1 * k) for k, n in enumerate(LENGTHS)]
    return write_dataset(tmp_path_factory.mktemp("learn") / "data", [*samples, remeshed("sway")])


def names(frames: Iterable[dict[str, Any]]) -> list[tuple[str, int]]:
    return [(frame["sample"], int(frame["frame"])) for frame in frames]


def in_order(dataset: Dataset) -> list[tuple[str, int]]:
    return [(row["id"], t) for row in dataset.rows for t in range(row["frames"])]


def loaded(frames: Any, workers: int = 0, **options: Any) -> list[tuple[str, int]]:
    """Names of what a DataLoader gives, frame by frame."""
    context = options.pop("multiprocessing_context", "fork")
    loader = DataLoader(
        frames,
        batch_size=None,
        num_workers=workers,
        multiprocessing_context=context if workers else None,
        **options,
    )
    return names(loader)


def test_frames_are_the_stored_arrays(dataset: Dataset) -> None:
    frames = FrameDataset(dataset, body=True)
    expected = list(load_frames(dataset, body=True))
    assert len(frames) == len(expected)
    for _ in range(2):  # the second time from memory, positions excepted
        for place, arrays in enumerate(expected):
            frame = frames[place]
            assert frame.keys() == arrays.keys()
            for key, value in arrays.items():
                if isinstance(value, np.ndarray):
                    np.testing.assert_array_equal(frame[key].numpy(), value.astype(frame[key].numpy().dtype))
                else:
                    assert frame[key] == value
    assert (frame["positions"].dtype, frame["faces"].dtype) == (torch.float32, torch.int64)


def test_indices_are_places_or_names(dataset: Dataset) -> None:
    frames = FrameDataset(str(dataset.root))
    assert [frames.locate(k) for k in range(len(frames))] == in_order(dataset)
    assert names([frames[-1], frames["s4", 2], frames["s4", -1]]) == [("sway", 6), ("s4", 2), ("s4", 4)]
    assert torch.equal(frames["s1", 3]["positions"], torch.tensor(dataset["s1"].positions[3]))
    assert names(FrameDataset(dataset, where={"frames": 1})) == [("s0", 0), ("s3", 0)]


def test_a_frame_owns_its_memory(dataset: Dataset) -> None:
    frames = FrameDataset(dataset)
    for key in ("positions", "faces"):
        frames["s1", 0][key].zero_()
        assert frames["s1", 0][key].any()


def test_little_is_kept(dataset: Dataset) -> None:
    frames = FrameDataset(dataset, cache=2)
    before = names(frames)
    assert list(frames._known) == ["s5", "sway"]
    assert all(sample.frame_positions(0).strides == (0, 0) for sample in frames._known.values())
    assert names(frames) == before == in_order(dataset)
    frames = FrameDataset(dataset)
    list(frames)
    assert len({id(sample.garments[0]) for sample in frames._known.values()}) == 2


@pytest.mark.parametrize(("workers", "context"), [(2, "fork"), (1, "spawn")])
def test_random_access_with_workers(dataset: Dataset, workers: int, context: str) -> None:
    frames = FrameDataset(dataset)
    frames[0]  # what the parent has open must not disturb its children
    options = {"shuffle": True, "generator": torch.Generator().manual_seed(3)}
    order = loaded(frames, workers, multiprocessing_context=context, **options)
    assert sorted(order) == sorted(in_order(dataset))
    options["generator"].manual_seed(3)
    assert loaded(frames, 0, **options) == order != in_order(dataset)


def test_indices_stay_when_the_dataset_grows(tmp_path: Path) -> None:
    write_dataset(tmp_path / "data", [make_sample("m", frames=3)])
    frames = FrameDataset(tmp_path / "data")
    shutil.rmtree(tmp_path / "data")
    write_dataset(tmp_path / "data", [make_sample("a", frames=2), make_sample("m", frames=3)])
    assert len(FrameDataset(tmp_path / "data")) == 5
    for same in (frames, pickle.loads(pickle.dumps(frames))):
        assert names(same) == [("m", 0), ("m", 1), ("m", 2)]


def test_a_stream_in_order(dataset: Dataset) -> None:
    stream = FrameStream(dataset, shuffle=False)
    assert names(stream) == loaded(stream) == in_order(dataset)
    assert stream.num_frames == len(in_order(dataset))
    frame = next(iter(stream))
    for name in GARMENT_ARRAYS:
        np.testing.assert_array_equal(frame[name], getattr(dataset["s0"].garment, name).astype(np.float32))


@pytest.mark.parametrize(("workers", "context"), [(0, "fork"), (1, "fork"), (2, "fork"), (1, "spawn")])
def test_a_stream_gives_every_frame_once(dataset: Dataset, workers: int, context: str) -> None:
    stream = FrameStream(dataset, seed=5, buffer=4)
    order = loaded(stream, workers, multiprocessing_context=context)
    assert Counter(order) == Counter(in_order(dataset))
    assert order != in_order(dataset)
    assert loaded(stream, workers) == order


def test_ranks_share_a_stream_without_overlap(dataset: Dataset) -> None:
    for workers in (0, 2):
        ranks = [FrameStream(dataset, seed=1, rank=rank, world_size=3) for rank in range(3)]
        together = [name for rank in ranks for name in loaded(rank, workers)]
        assert Counter(together) == Counter(in_order(dataset))


def test_shuffling_is_seeded_and_differs_by_epoch(dataset: Dataset) -> None:
    stream, same, other = (FrameStream(dataset, seed=seed, buffer=8) for seed in (2, 2, 3))
    first = names(stream)
    assert names(same) == first != names(other)
    stream.set_epoch(1)
    assert names(stream) != first
    assert sorted(names(stream)) == sorted(first)
    stream.set_epoch(0)
    assert names(stream) == first


def test_a_buffer_mixes_samples(dataset: Dataset) -> None:
    runs = [
        sum(a[0] != b[0] for a, b in pairwise(order))
        for order in (names(FrameStream(dataset, buffer=size)) for size in (1, 16))
    ]
    assert runs[0] == len(dataset) - 1 < runs[1]


def test_workers_that_live_on_see_the_next_epoch(dataset: Dataset) -> None:
    stream = FrameStream(dataset, buffer=8)
    loader = DataLoader(
        stream, batch_size=None, num_workers=2, persistent_workers=True, multiprocessing_context="fork"
    )
    first = names(loader)
    stream.set_epoch(1)
    second = names(loader)
    assert first != second
    assert sorted(first) == sorted(second) == sorted(in_order(dataset))
    assert second == loaded(stream, 2)


def test_batches_of_different_topologies(dataset: Dataset) -> None:
    frames = [FrameDataset(dataset)[index] for index in (("s1", 2), ("sway", 2), ("sway", 0))]
    batch = collate(frames)
    assert batch["sample"] == ["s1", "sway", "sway"]
    assert batch["frame"].tolist() == [2, 2, 0]
    assert batch["vertex_ptr"].tolist() == [0, *np.cumsum([len(f["positions"]) for f in frames]).tolist()]
    for k, frame in enumerate(frames):
        vertices, faces, panel = (
            slice(*batch[f"{what}_ptr"][k : k + 2].tolist()) for what in ("vertex", "face", "panel_vertex")
        )
        assert torch.equal(batch["positions"][vertices], frame["positions"])
        assert (batch["vertex_batch"][vertices] == k).all()
        corners = batch["positions"][batch["faces"][faces]]
        assert torch.equal(corners, frame["positions"][frame["faces"]])
        flat = batch["panel_vertices"][batch["panel_faces"][faces]]
        assert torch.equal(flat, frame["panel_vertices"][frame["panel_faces"]])
        sewn = batch["positions"][batch["panel_to_vertex"][panel]]
        assert torch.equal(sewn, frame["positions"][frame["panel_to_vertex"]])
        assert torch.equal(batch["uv"][panel], frame["uv"])
    assert len(batch["vertex_batch"]) == len(batch["positions"])


def test_batches_pad_shapes_and_stack_poses() -> None:
    frames = [
        {
            "sample": name,
            "positions": torch.zeros(n, 3),
            "beta": torch.arange(1.0, n),
            "pose": torch.full((24, 3), float(n)),
        }
        for name, n in (("a", 3), ("b", 2))
    ]
    batch = collate(frames)
    assert batch["beta"].tolist() == [[1.0, 2.0], [1.0, 0.0]]
    assert batch["pose"].shape == (2, 24, 3)
    assert batch["pose"][:, 0, 0].tolist() == [3.0, 2.0]


def test_a_loader_makes_batches(dataset: Dataset) -> None:
    loader = DataLoader(
        FrameDataset(dataset, body=True), 4, num_workers=2, collate_fn=collate, multiprocessing_context="fork"
    )
    told = [name for batch in loader for name in zip(batch["sample"], batch["frame"].tolist(), strict=True)]
    assert told == in_order(dataset)


def test_what_cannot_be_is_told(dataset: Dataset, tmp_path: Path) -> None:
    frames = FrameDataset(dataset)
    with pytest.raises(IndexError, match="frame 23 of 23; give 0 to 22"):
        frames[len(frames)]
    for _ in range(2):
        with pytest.raises(InputError, match=r"'s1' has no frame 4; give 0 to 3"):
            frames["s1", 4]
    with pytest.raises(InputError, match="no sample 'sq'"):
        frames["sq", 0]
    with pytest.raises(InputError, match="has no split 'train'"):
        FrameStream(dataset, "train")
    with pytest.raises(InputError, match="no muslin dataset here"):
        FrameDataset(tmp_path)
    with pytest.raises(InputError, match="rank = 2 of world_size = 2"):
        FrameStream(dataset, rank=2, world_size=2)
    with pytest.raises(InputError, match="give both, or neither"):
        FrameStream(dataset, rank=1)
    with pytest.raises(InputError, match="buffer = 0; it must be at least 1"):
        FrameStream(dataset, buffer=0)
    with pytest.raises(InputError, match="no frames"):
        collate([])
    mixed = [{"sample": "a", "positions": torch.zeros(1, 3)}, {"sample": "b"}]
    with pytest.raises(InputError, match="samples a and b: only one of them has 'positions'"):
        collate(mixed)
