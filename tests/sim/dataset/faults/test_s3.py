"""A dataset in an object store, spoken to over a connection: as in a folder, whatever befalls it."""

from __future__ import annotations

import random
import signal
import time
from pathlib import Path

import numpy as np
import pytest
from faulty_producer import simulate
from s3_server import BadNet
from sheet_producer import make_scene, sheets_config
from sheets import SECONDS, make, mend, start, stored

from benchmarks.faults import Contents, contents, flip_bit, table, wait_until
from muslin.garments.errors import InputError
from muslin.sim.dataset import store
from muslin.sim.dataset.generate import generate
from muslin.sim.dataset.info import info
from muslin.sim.dataset.reader import open_dataset
from muslin.sim.dataset.root import open_root
from muslin.sim.dataset.verify import verify

LEASE = (0.5, 6.0)


def test_a_dataset_in_a_store_is_that_of_a_folder(
    peaceful: Path, undisturbed: Contents, bucket: str, tmp_path: Path
) -> None:
    place = f"{bucket}/sheets"
    seen: list[int] = []

    def read(done: float, total: int, message: str) -> None:
        found = contents(place)
        assert all(undisturbed[sample_id] == found[sample_id] for sample_id in found)
        seen.append(len(found))

    drapes = sheets_config().model_copy(update={"kind": "drape"})
    assert drapes.kind == "drape"
    first = generate(drapes, place, workers=1, simulate=simulate, make_scene=make_scene, progress=read)
    report = make(place, progress=read)
    assert (len(first.made), len(report.made), len(report.kept)) == (8, 1, 8)
    assert len({0, 8, *seen}) > 2
    assert contents(place) == undisturbed
    assert table(place) == table(peaceful)
    assert info(place).geometry_sha256 == info(peaceful).geometry_sha256
    assert verify(place, workers=1).passed
    sequence = open_dataset(peaceful).where(kind="sequence").ids[0]
    for frame in (0, 17, 29):
        there = open_dataset(place).frame(sequence, frame)
        assert np.array_equal(there, open_dataset(peaceful).frame(sequence, frame))
    name = store.sample_name(sequence)
    damaged = tmp_path / "damaged"
    damaged.write_bytes(open_root(place).read(name))
    flip_bit(damaged, random.Random(3))
    open_root(place).write(name, damaged.read_bytes())
    assert list(verify(place, workers=1).failed) == [sequence]
    assert mend(place).made == (sequence,)
    assert contents(place) == undisturbed


def test_a_bad_net_costs_time_and_nothing_else(undisturbed: Contents, bucket: str, s3: str) -> None:
    net = BadNet(s3, seed=5)
    with net.open() as address:
        run = start(f"{bucket}/sheets", {"AWS_ENDPOINT_URL": address}, workers=1)
        made, said = run.communicate(timeout=SECONDS)
    assert run.returncode == 0, said
    assert sum(map(int, made.split())) == 9
    assert net.faults > 5
    assert contents(f"{bucket}/sheets") == undisturbed


def test_the_second_of_two_runs_is_told_and_takes_over_from_a_killed_one(
    undisturbed: Contents, bucket: str, tmp_path: Path
) -> None:
    place, hold = f"{bucket}/sheets", tmp_path / "hold"
    hold.touch()
    first = start(place, {"FAULT_HOLD": str(hold)}, lease=LEASE, workers=1)
    wait_until(lambda: stored(place), "a sample")
    second = start(place, lease=LEASE, workers=1)
    _, said = second.communicate(timeout=SECONDS)
    assert second.returncode == 2
    assert "another process (process" in said
    first.send_signal(signal.SIGKILL)
    first.communicate()
    before = stored(place)
    third = start(place, lease=LEASE, workers=1)
    made, said = third.communicate(timeout=SECONDS)
    assert made == f"{9 - before} {before} 0\n", said
    assert contents(place) == undisturbed


def test_a_bucket_that_is_not_there_is_told(s3: str) -> None:
    with pytest.raises(InputError, match=r"s3://nowhere/sheets: cannot be used .*make the bucket"):
        make("s3://nowhere/sheets")


def test_a_store_out_of_reach_is_told_within_bounded_time(s3: str) -> None:
    begun = time.monotonic()
    run = start("s3://nowhere/sheets", {"AWS_ENDPOINT_URL": "http://127.0.0.1:9"}, workers=1)
    _, said = run.communicate(timeout=SECONDS)
    assert run.returncode == 2, said
    assert "the store failed 3 times" in said
    assert "Traceback" not in said
    assert time.monotonic() - begun < SECONDS
