"""Scores between sequences of different and of changing topology, where exact errors are known."""

from __future__ import annotations

from functools import lru_cache
from pathlib import Path

import numpy as np
import pytest

from muslin.eval.compare import compare
from muslin.eval.comparison_report import heat_map
from muslin.eval.read.subject import open_subject
from muslin.garments import catalogue
from muslin.garments.mesh import GarmentMesh
from muslin.garments.obj import write_garment
from muslin.garments.triangulate import triangulate
from muslin.sim.dataset.certificate import Certificate
from muslin.sim.dataset.export import export_dataset
from muslin.sim.dataset.reader import write_dataset
from muslin.sim.dataset.remeshed import sample_of_frames
from muslin.sim.dataset.sample import Sample

FPS = 25.0
LIFT = 0.02  # metres; bounds of the Hausdorff distance of surfaces that coincide take long
FIXED, CHANGING = (0, 0, 0, 0, 0), (1, 1, 2, 2, 1)


@lru_cache
def mesh(k: int, design: str = "sheet") -> GarmentMesh:
    return triangulate(catalogue.get(design).pattern(), (0.15, 0.2, 0.11)[k], seed=k)


def points(garment: GarmentMesh) -> np.ndarray:
    u = np.empty((garment.num_vertices, 2))
    u[garment.panel_to_vertex] = garment.panel_vertices
    return u


def moved(garment: GarmentMesh, t: int, error: np.ndarray | float = 0.0) -> np.ndarray:
    """Linear in panel space, so exact on every mesh; `error` (V,) or a number, metres, along the normal."""
    u = points(garment)
    shear = 0.1 * t
    return np.stack(
        [u[:, 0] + shear * u[:, 1] + 0.02 * t, 0.03 * t + 0.0 * u[:, 0] + error, -u[:, 1]], axis=1
    )


def sequence(
    places: tuple[int, ...], error=lambda u, t: 0.0, name: str = "a", design: str = "sheet"
) -> Sample:
    """The moved sheet on mesh `places[t]` in frame t, off by error(u, t), metres."""
    meshes = [mesh(k, design) for k in places]
    positions = [moved(g, t, error(points(g), t)) for t, g in enumerate(meshes)]
    return sample_of_frames(
        meshes,
        positions,
        id=name,
        kind="sequence" if len(places) > 1 else "drape",
        certificate=Certificate(),
        fps=FPS if len(places) > 1 else None,
        labels={"design": design},
    ).validate()


def scores(folder: Path, prediction: Sample, truth: Sample) -> dict:
    write_dataset(folder / "p", [prediction])
    write_dataset(folder / "t", [truth])
    return compare(folder / "p", folder / "t", surface_frames=1).to_dict()


@pytest.mark.parametrize(
    ("prediction", "truth"),
    [
        (CHANGING, FIXED),
        (FIXED, CHANGING),
        (CHANGING, (2, 2, 2, 0, 0)),
        ((1,) * 5, FIXED),
    ],
)
def test_a_constant_offset_between_any_meshes(tmp_path, prediction, truth):
    result = scores(tmp_path, sequence(prediction, lambda u, t: LIFT), sequence(truth))
    # stored in float32: some 1e-7 m, times the frame rate for velocities
    for figure in ("mean", "rms", "median", "p95", "max"):
        assert result["vertex_error_mm"][figure] == pytest.approx(1000 * LIFT, abs=1e-3)
        assert result["vertex_error_area_weighted_mm"][figure] == pytest.approx(1000 * LIFT, abs=1e-3)
    assert result["velocity_error_mm_s"]["max"] < 2e-2
    assert result["hausdorff_mm"] == pytest.approx(1000 * LIFT, abs=1e-3)
    assert len(result["pairs"][0]["frames"]["vertex_mean"]) == 5
    assert len(result["pairs"][0]["frames"]["velocity_mean"]) == 4
    assert any("panel-space" in note for note in result["notes"])


@pytest.mark.parametrize(("prediction", "truth"), [(CHANGING, FIXED), (FIXED, CHANGING)])
def test_errors_are_those_at_the_truths_vertices(tmp_path, prediction, truth):
    # Off along the normal by 20 mm + 2 mm x frame x (1 + u_x): linear, so exact wherever it is looked up.
    off = sequence(prediction, lambda u, t: LIFT + 2e-3 * t * (1 + u[:, 0]))
    result = scores(tmp_path, off, sequence(truth))
    weights = [1 + points(mesh(k))[:, 0] for k in truth]
    expected = np.concatenate([1000 * LIFT + 2.0 * t * w for t, w in enumerate(weights)])
    assert result["vertex_error_mm"]["mean"] == pytest.approx(expected.mean(), rel=1e-4)
    assert result["vertex_error_mm"]["max"] == pytest.approx(expected.max(), rel=1e-4)
    # Each frame adds 2 mm x (1 + u_x): across a change of topology as well, at the later frame's vertices.
    speed = 2.0 * FPS * np.concatenate(weights[1:])
    assert result["velocity_error_mm_s"]["mean"] == pytest.approx(speed.mean(), rel=1e-3)
    assert result["velocity_error_mm_s"]["max"] == pytest.approx(speed.max(), rel=1e-3)
    per_frame = result["pairs"][0]["frames"]["velocity_mean"]
    assert per_frame == pytest.approx([2.0 * FPS * w.mean() for w in weights[1:]], rel=1e-3)
    # Weighted by area, a linear error has its value at the middle, whatever the mesh.
    areas = result["vertex_error_area_weighted_mm"]["mean"]
    assert areas == pytest.approx(np.mean([1000 * LIFT + 2.0 * t for t in range(5)]), rel=5e-3)


def test_drapes_of_other_topology_have_vertex_errors(tmp_path):
    result = scores(tmp_path, sequence((1,), lambda u, t: LIFT), sequence((0,)))
    assert result["vertex_error_mm"]["mean"] == pytest.approx(1000 * LIFT, abs=1e-3)
    assert result["velocity_error_mm_s"] is None


def test_other_designs_have_surface_distances_only(tmp_path):
    other = sample_of_frames(
        [mesh(2, "tee")],
        [np.c_[points(mesh(2, "tee")), np.zeros(mesh(2, "tee").num_vertices)]],
        id="a",
        kind="drape",
        certificate=Certificate(),
    )
    result = scores(tmp_path, other, sequence((0,)))
    assert result["vertex_error_mm"] is None
    assert result["velocity_error_mm_s"] is None
    assert result["hausdorff_mm"] > 1.0
    assert any("null: two meshes are of different patterns" in note for note in result["notes"])


def test_exported_frames_of_changing_topology_compare_with_their_sample(tmp_path):
    truth = sequence(CHANGING)
    write_dataset(tmp_path / "t", [truth])
    export_dataset(tmp_path / "t", tmp_path / "obj", "obj", body=False)
    result = compare(tmp_path / "obj" / "a", tmp_path / "t", fps=FPS).to_dict()
    assert result["vertex_error_mm"]["max"] < 1e-5  # the same faces in every frame
    assert result["velocity_error_mm_s"] is None
    (note,) = [note for note in result["notes"] if "velocity, acceleration and jerk are null" in note]
    assert "no panels" in note


def test_obj_files_with_panels_correspond(tmp_path):
    for t, k in enumerate(CHANGING):
        for side, place, lift in (("p", k, LIFT + 0.003 * t), ("t", FIXED[t], 0.0)):
            (tmp_path / side).mkdir(exist_ok=True)
            write_garment(mesh(place), tmp_path / side / f"{t}.obj", moved(mesh(place), t, lift))
    result = compare(tmp_path / "p", tmp_path / "t", fps=FPS, surface_frames=1).to_dict()
    assert result["pairs"][0]["frames"]["vertex_mean"] == pytest.approx([20, 23, 26, 29, 32], abs=1e-4)
    assert result["velocity_error_mm_s"]["rms"] == pytest.approx(3.0 * FPS, rel=1e-6)


def test_penetration_and_heat_map_of_changing_topology(tmp_path, make_sample):
    from dataclasses import replace

    ball = make_sample()
    body = {"obstacle_vertices": ball.obstacle_vertices, "obstacle_faces": ball.obstacle_faces}
    through = replace(sequence(CHANGING, lambda u, t: LIFT - 0.03 * t), **body)
    result = scores(tmp_path, through, replace(sequence(CHANGING), **body))
    radius = [np.linalg.norm(through.frame_positions(t), axis=1) for t in range(5)]
    share = np.mean(np.concatenate(radius) < 0.2)
    assert share > 0.05
    assert result["penetration"]["ratio"] == pytest.approx(share, abs=0.01)
    tracks = [open_subject(tmp_path / side).load("a") for side in ("p", "t")]
    image = heat_map(*tracks, 2)
    assert image.shape[0] == 520
    assert image.std() > 10
