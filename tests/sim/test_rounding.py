"""Rounded positions lie on the grid, near where they were, and are only kept where nothing crosses."""

from __future__ import annotations

import subprocess
import sys
import zipfile
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from muslin.garments.mesh import GarmentMesh
from muslin.sim.certify import certify_rounded
from muslin.sim.dataset import store
from muslin.sim.dataset.certificate import Certificate
from muslin.sim.dataset.reader import write_dataset
from muslin.sim.dataset.sample import Sample
from muslin.sim.dataset.verify import verify
from muslin.sim.rounding import MAX_ERROR_M, STEP_M, round_sample, to_grid

BAR_M = 1e-5


@given(arrays(np.float32, (7, 3), elements=st.floats(-100.0, 100.0, width=32)))
def test_rounding_is_near_on_the_grid_and_idempotent(positions: np.ndarray) -> None:
    rounded = to_grid(positions)
    assert rounded.dtype == np.float32
    steps = rounded.astype(np.float64) / STEP_M
    np.testing.assert_array_equal(steps, np.round(steps))
    moved = np.linalg.norm(rounded.astype(np.float64) - positions.astype(np.float64), axis=1)
    assert moved.max() <= MAX_ERROR_M <= BAR_M
    np.testing.assert_array_equal(to_grid(rounded), rounded)


def patches(gap: float, phase: float, n: int = 40) -> Sample:
    """Two square patches of 30 cm, n x n vertices, one `gap` above the other, rippled from `phase` on."""
    line = np.linspace(0.0, 0.3, n)
    u, v = (grid.ravel() for grid in np.meshgrid(line, line, indexing="ij"))
    corner = np.arange(n * n, dtype=np.int32).reshape(n, n)
    a, b, c, d = corner[:-1, :-1], corner[1:, :-1], corner[1:, 1:], corner[:-1, 1:]
    one = np.concatenate([np.stack([p.ravel() for p in t], axis=1) for t in ((a, d, c), (a, c, b))])
    faces = np.concatenate([one, one + n * n]).astype(np.int32)
    height = 1.0 + 0.02 * np.sin(20.0 * u + phase) * np.cos(15.0 * v)
    lower = np.stack([u, height, v], axis=1)
    panel = np.concatenate([np.stack([u + shift, 0.3 - v], axis=1) for shift in (0.0, 0.4)])
    mesh = GarmentMesh(
        faces=faces,
        panel_faces=faces,
        panel_vertices=panel,
        panel_to_vertex=np.arange(2 * n * n, dtype=np.int32),
        face_panel=np.repeat(np.arange(2, dtype=np.int32), len(one)),
        panel_names=("lower", "upper"),
        uv=panel,
        name="patches",
        parameters={},
    )
    upper = lower + np.array([0.0, gap, 0.0])
    positions = np.concatenate([lower, upper])[None].astype(np.float32)
    return Sample("patches", "drape", mesh, positions, Certificate())


def test_apart_sheets_are_stored_on_the_grid(tmp_path: Path) -> None:
    found = certify_rounded(patches(1e-4, 0.3), Certificate())
    assert found.certificate.extra["position_step_m"] == STEP_M
    np.testing.assert_array_equal(found.positions, to_grid(found.positions))
    write_dataset(tmp_path / "data", [found])
    assert verify(tmp_path / "data", workers=1).passed


def test_what_would_cross_on_the_grid_is_kept_without_rounding(tmp_path: Path) -> None:
    sample = patches(2e-6, 0.3, n=15)
    crossed = certify_rounded(sample, Certificate())
    assert crossed.certificate.extra["position_step_m"] == 0.0
    assert crossed.certificate.cloth_cloth_intersections == 0
    np.testing.assert_array_equal(crossed.positions, sample.positions)
    data = write_dataset(tmp_path / "data", [crossed])
    assert data["patches"].positions.tobytes() == sample.positions.tobytes()
    assert verify(tmp_path / "data", workers=1).passed
    rounded = write_dataset(tmp_path / "rounded", [round_sample(sample)])
    assert not verify(rounded.root, workers=1).passed


def test_what_crosses_anyhow_is_kept_as_it_is_and_counted() -> None:
    sample = patches(1e-3, 0.3)
    sample.positions[0, -1, 1] -= np.float32(0.01)
    found = certify_rounded(sample, Certificate())
    assert found.certificate.cloth_cloth_intersections
    assert found.certificate.extra["position_step_m"] == 0.0
    np.testing.assert_array_equal(found.positions, sample.positions)


def test_a_moving_sheet_takes_less_than_45_percent_of_float32(tmp_path: Path) -> None:
    still = patches(1e-3, 0.0)
    frames = np.concatenate([patches(1e-3, 0.05 * t).positions for t in range(60)])
    sample = round_sample(replace(still, positions=frames, kind="sequence", fps=60.0))
    for folder in ("one", "two"):
        write_dataset(tmp_path / folder, [sample])
    files = [
        {p.name: p.read_bytes() for p in (root / "samples").iterdir()}
        for root in (tmp_path / "one", tmp_path / "two")
    ]
    assert files[0] == files[1]
    with zipfile.ZipFile(store.sample_file(tmp_path / "one", "patches")) as archive:
        array = [entry for entry in archive.infolist() if entry.filename.startswith("positions/")]
    assert sum(entry.compress_size for entry in array) <= 0.45 * sample.positions.nbytes


@pytest.mark.parametrize("step", [0.0, STEP_M])
def test_plain_zarr_reads_what_was_written(tmp_path: Path, step: float) -> None:
    sample = patches(1e-3, 0.1)
    sample = round_sample(sample) if step else sample
    write_dataset(tmp_path / "data", [sample])
    np.save(tmp_path / "truth.npy", sample.positions)
    code = (
        "import sys, numpy, zarr\n"
        "packed = zarr.storage.ZipStore(sys.argv[1], mode='r')\n"
        "found = zarr.open_group(packed, mode='r')['positions'][...]\n"
        "assert found.tobytes() == numpy.load(sys.argv[2]).tobytes()\n"
        "assert not any(name.split('.')[0] == 'muslin' for name in sys.modules)\n"
    )
    place = store.sample_file(tmp_path / "data", "patches")
    subprocess.run([sys.executable, "-c", code, place, tmp_path / "truth.npy"], check=True)
