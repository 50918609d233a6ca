"""Verification counts again, believes no certificate, and goes on past what is damaged."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from sheet_producer import RADIUS, ball, make_sample
from unpacked import chunk_of, unpacked

from muslin.garments.errors import InputError
from muslin.sim.body import load_body
from muslin.sim.dataset import store
from muslin.sim.dataset.reader import write_dataset
from muslin.sim.dataset.sample import BodyTrack, Sample
from muslin.sim.dataset.verify import FRAMES_A_TASK, verify


def spoiled(sample: Sample, frame: int, height: float) -> Sample:
    positions = sample.positions.copy()
    positions[frame, :, 1] = height
    return replace(sample, positions=positions)


def body_sample(sample_id: str = "worn", digest: str | None = None, height: float = 3.0) -> Sample:
    """A sheet that floats above the default body, or cuts it."""
    model = load_body("female")
    track = BodyTrack("female", digest or model.digest, np.zeros(10), np.zeros((1, 24, 3)), np.zeros((1, 3)))
    sample = spoiled(make_sample(sample_id), 0, height)
    return replace(sample, body=track, obstacle_vertices=None, obstacle_faces=None)


def test_clean_samples_pass_with_any_number_of_workers(tmp_path: Path) -> None:
    frames = 2 * FRAMES_A_TASK + 3
    samples = [make_sample("a"), make_sample("b", frames=frames), body_sample()]
    write_dataset(tmp_path / "data", samples)
    told: list[tuple[float, int]] = []
    one = verify(tmp_path / "data", workers=1, progress=lambda done, total, _: told.append((done, total)))
    assert told == [(k, 5) for k in range(1, 6)]
    assert one.passed
    assert one.to_dict() == {
        "samples": 3,
        "frames": frames + 2,
        "cloth_cloth_intersections": 0,
        "cloth_body_intersections": 0,
        "masked_body_faces_max": 0,
        "missing": 0,
        "failed": [],
        "reasons": {},
    }
    assert verify(tmp_path / "data", workers=2) == one
    one.write_json(tmp_path / "report.json")
    assert json.loads((tmp_path / "report.json").read_text()) == one.to_dict()


def test_an_intersection_in_one_frame_fails_its_sample_whatever_the_certificate_says(tmp_path: Path) -> None:
    late = FRAMES_A_TASK + 1
    cut = spoiled(make_sample("cut", frames=late + 2), late, 0.5 * RADIUS)
    folded = make_sample("folded")
    positions = folded.positions.copy()
    corner = np.linalg.norm(positions[0, :, [0, 2]].T - 0.5, axis=1)
    # Neighbours of a corner go up, the corner below the middle of the sheet: its edges pierce the cloth.
    positions[0, corner < 0.2, 1] += 0.05
    positions[0, np.argmin(corner)] -= [0.45, 0.1, 0.45]
    write_dataset(
        tmp_path / "data",
        [make_sample("good"), cut, replace(folded, positions=positions), body_sample(height=0.2)],
    )
    report = verify(tmp_path / "data", workers=1)
    assert cut.certificate.cloth_body_intersections == 0
    assert list(report.failed) == ["cut", "folded", "worn"]
    assert f"frame {late}: " in report.failed["cut"]
    assert "cloth-body intersections" in report.failed["cut"]
    assert "cloth-cloth intersections" in report.failed["folded"]
    assert "cloth-body intersections" in report.failed["worn"]
    assert report.cloth_cloth_intersections > 0
    assert report.cloth_body_intersections > 0


def overlapping_balls(sample_id: str, masked: np.ndarray) -> Sample:
    """Two balls that overlap by a third of their radius, the sheet above them."""
    vertices, faces = ball()
    both = np.concatenate([vertices, vertices + np.float32([0.2, 0.0, 0.0])], axis=1)
    solid = np.concatenate([faces, faces + vertices.shape[1]]).astype(np.int32)
    return replace(
        make_sample(sample_id), obstacle_vertices=both, obstacle_faces=solid, masked_faces=(masked,)
    )


def test_only_faces_inside_the_body_may_be_masked(tmp_path: Path) -> None:
    vertices, faces = ball()
    centres = vertices[0][faces].mean(axis=1)
    # Faces of the first ball that are deep in the second one, and one that is not.
    inside = np.flatnonzero(np.linalg.norm(centres - [0.2, 0, 0], axis=1) < 0.2 * RADIUS + 0.1).astype(
        np.int32
    )
    outside = np.argmin(centres[:, 0]).astype(np.int32)
    assert len(inside) > 4
    samples = [
        overlapping_balls("inside", inside),
        overlapping_balls("outside", np.append(inside, outside)),
        overlapping_balls("nowhere", np.array([len(faces) * 2], dtype=np.int32)),
    ]
    write_dataset(tmp_path / "data", samples)
    report = verify(tmp_path / "data", workers=1)
    assert report.masked_body_faces_max == len(inside) + 1
    assert report.failed.keys() == {"outside", "nowhere"}
    assert f"1 of {len(inside) + 1} masked body faces do not lie inside" in report.failed["outside"]
    assert f"from 0 to {2 * len(faces) - 1}" in report.failed["nowhere"]


def test_another_body_than_the_one_it_was_made_with_fails(tmp_path: Path) -> None:
    unknown = body_sample("unknown")
    assert unknown.body is not None
    unknown = replace(unknown, body=replace(unknown.body, model=str(tmp_path / "none.npz")))
    write_dataset(tmp_path / "data", [body_sample("other", digest="0" * 64), unknown])
    report = verify(tmp_path / "data", workers=1)
    assert "has digest" in report.failed["other"]
    assert "none.npz" in report.failed["unknown"]


def test_damaged_samples_fail_and_the_rest_is_checked(tmp_path: Path) -> None:
    root = tmp_path / "data"
    write_dataset(root, [make_sample(name) for name in ("array", "gone", "good", "header", "torn")])
    with unpacked(store.sample_file(root, "array")) as folder:
        chunk_of(folder, "positions").write_bytes(b"\0" * 40)
    with unpacked(store.sample_file(root, "header")) as folder:
        (folder / "zarr.json").write_text("{")
    store.sample_file(root, "gone").rename(tmp_path / "elsewhere")
    torn = store.sample_file(root, "torn")
    torn.write_bytes(torn.read_bytes()[:-1000])
    report = verify(root, workers=1)
    assert (report.samples, report.frames) == (5, 1)
    assert list(report.failed) == ["array", "gone", "header", "torn"]
    assert "torn.zarr.zip: not readable" in report.failed["torn"]
    assert "array.zarr.zip/positions" in report.failed["array"]
    assert "is missing" in report.failed["gone"]
    assert "zarr.json: not readable" in report.failed["header"]


def test_samples_not_made_yet_are_missing_not_failed(tmp_path: Path) -> None:
    root = tmp_path / "data"
    write_dataset(root, [make_sample("a"), make_sample("b")])
    store.sample_file(root, "b").rename(tmp_path / "elsewhere")
    (root / "index.parquet").unlink()
    report = verify(root, workers=1)
    assert (report.samples, report.missing, report.passed) == (1, 1, True)


def test_no_dataset(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"muslin\.json is missing"):
        verify(tmp_path)
