"""One frame is read without the others, bit for bit, and never where its chunks are damaged."""

from __future__ import annotations

import pickle
import time
from pathlib import Path

import numpy as np
import pytest
from remeshed_producer import FRAME_TOPOLOGY, remeshed
from sheet_producer import make_sample
from unpacked import chunk_of, replace_file, unpacked

from muslin.garments.errors import InputError
from muslin.sim.dataset import store
from muslin.sim.dataset.reader import Dataset, open_dataset, write_dataset

FRAMES = 700
"""Of 81 vertices: three chunks a coordinate."""


@pytest.fixture
def dataset(tmp_path: Path) -> Dataset:
    return write_dataset(
        tmp_path / "data", [make_sample("wave", frames=FRAMES), make_sample("still"), remeshed()]
    )


@pytest.fixture
def still(tmp_path: Path) -> Path:
    return store.sample_file(tmp_path / "data", "still")


@pytest.fixture
def wave(tmp_path: Path) -> Path:
    return store.sample_file(tmp_path / "data", "wave")


def test_frames_are_those_of_the_whole_sample(dataset: Dataset) -> None:
    wave = dataset["wave"].positions
    for frame in (0, 1, 269, 270, 350, FRAMES - 1, -1, -FRAMES):
        found = dataset.frame("wave", frame)
        assert found.dtype == np.float32
        assert found.tobytes() == wave[frame].tobytes()
    assert dataset.frame(1, 0).tobytes() == dataset["still"].positions[0].tobytes()


def test_frames_of_changing_topology(dataset: Dataset) -> None:
    whole = dataset["sway"]
    for frame in range(len(FRAME_TOPOLOGY)):
        assert dataset.frame("sway", frame).tobytes() == whole.frame_positions(frame).tobytes()


def test_what_is_not_there_is_named(dataset: Dataset) -> None:
    with pytest.raises(InputError, match=rf"no frame {FRAMES}; give 0 to {FRAMES - 1}"):
        dataset.frame("wave", FRAMES)
    with pytest.raises(InputError, match="no frame -2; give 0 to 0"):
        dataset.frame("still", -2)
    with pytest.raises(InputError, match="no sample 'wawe'; it has wave"):
        dataset.frame("wawe", 0)


@pytest.mark.parametrize("opened_before", [False, True])
def test_any_flipped_bit_is_found_by_a_frame_that_needs_it(
    dataset: Dataset, still: Path, opened_before: bool
) -> None:
    """A bit of every seventh byte of the shard is flipped in turn, and the frame refused each time.

    The archive is packed anew, so that its own checksums tell nothing.
    """
    file, truth = still.read_bytes(), dataset["still"].positions[0]
    if opened_before:
        dataset.frame("still", 0)
    with unpacked(still) as folder:
        whole = chunk_of(folder, "positions").read_bytes()
    for place in range(0, len(whole), 7):
        damaged = bytearray(whole)
        damaged[place] ^= 1 << (place % 8)
        with unpacked(still) as folder:
            chunk_of(folder, "positions").write_bytes(damaged)
        with pytest.raises(InputError, match=r"still\.zarr\.zip/positions: .*restore"):
            dataset.frame("still", 0)
        replace_file(still, file)
    np.testing.assert_array_equal(dataset.frame("still", 0), truth)


def test_damage_to_one_chunk_leaves_the_frames_of_others_readable(dataset: Dataset, wave: Path) -> None:
    truth = dataset["wave"].positions
    with unpacked(wave) as folder:
        chunk = chunk_of(folder, "positions")
        damaged = bytearray(chunk.read_bytes())
        damaged[20] ^= 0x10  # of the first chunk, or the last, as zarr orders them
        chunk.write_bytes(damaged)
    refused = 0
    for frame in (0, 350, FRAMES - 1):
        try:
            found = dataset.frame("wave", frame)
        except InputError:
            refused += 1
        else:
            np.testing.assert_array_equal(found, truth[frame])
    assert refused == 1


def test_a_missing_shard_is_no_frame_of_zeros(dataset: Dataset, wave: Path) -> None:
    with unpacked(wave) as folder:
        chunk_of(folder, "positions").unlink()
    with pytest.raises(InputError, match="part of frame 3 is missing"):
        dataset.frame("wave", 3)


def test_flat_cloth_at_zero_is_stored(tmp_path: Path) -> None:
    """zarr leaves out chunks that hold nothing but the fill value, which is why that is NaN."""
    sample = make_sample("flat")
    sample.positions[...] = 0.0
    made = write_dataset(tmp_path / "data", [sample])
    np.testing.assert_array_equal(made.frame("flat", 0), sample.positions[0])


def test_an_array_of_other_shape_is_refused(dataset: Dataset, wave: Path) -> None:
    with unpacked(wave) as folder:
        file = folder / "positions" / "zarr.json"
        file.write_text(file.read_text().replace(f"{FRAMES},", f"{FRAMES - 1},", 1))
    with pytest.raises(InputError, match=rf"{FRAMES - 1}, 81, 3.*where.*{FRAMES}, 81"):
        dataset.frame("wave", 0)


def test_a_sample_that_replaced_another_is_read_anew(dataset: Dataset, still: Path, tmp_path: Path) -> None:
    before = dataset.frame("still", 0)
    other = write_dataset(tmp_path / "other", [make_sample("still", clearance=0.3)])
    assert len(other) == 1
    still.rename(tmp_path / "aside")
    store.sample_file(tmp_path / "other", "still").rename(still)
    assert not np.array_equal(dataset.frame("still", 0), before)


def test_one_frame_costs_less_than_all(dataset: Dataset) -> None:
    def fastest(read: object) -> float:
        seconds = []
        for _ in range(5):
            begun = time.perf_counter()
            read()  # type: ignore[operator]
            seconds.append(time.perf_counter() - begun)
        return min(seconds)

    assert fastest(lambda: dataset.frame("wave", 400)) < fastest(lambda: dataset["wave"])


def test_a_dataset_that_was_read_from_can_be_handed_to_other_processes(dataset: Dataset) -> None:
    dataset.frame("wave", 0)
    again = pickle.loads(pickle.dumps(open_dataset(dataset.root)))
    np.testing.assert_array_equal(again.frame("wave", 9), dataset.frame("wave", 9))
