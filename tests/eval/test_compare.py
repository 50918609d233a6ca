"""Comparisons of samples, datasets and mesh files whose scores are known."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import trimesh

from muslin.eval.compare import compare
from muslin.eval.read.check import check_mesh
from muslin.eval.read.meshes import read_mesh
from muslin.garments.errors import InputError
from muslin.sim.dataset.reader import write_dataset

QUAD = "v 0 0 0\nv 1 0 0.2\nv 1 1 0\nv 0 1 0.2\n"


def write(path: Path, text: str) -> Path:
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(text)
    return path


def shifted(sample, offset):
    return replace(sample, positions=(sample.positions + np.asarray(offset)).astype(np.float32))


def test_lifted_sheet_scores_its_lift(tmp_path, make_sample):
    truth = [make_sample("a"), make_sample("b", frames=4)]
    write_dataset(tmp_path / "truth", truth)
    write_dataset(tmp_path / "prediction", [shifted(s, [0, 0.005, 0]) for s in truth])
    result = compare(tmp_path / "prediction", tmp_path / "truth").to_dict()
    for figure in ("mean", "rms", "median", "p95", "max"):
        assert result["vertex_error_mm"][figure] == pytest.approx(5.0, abs=1e-4)
        assert result["vertex_error_area_weighted_mm"][figure] == pytest.approx(5.0, abs=1e-4)
    assert result["velocity_error_mm_s"]["mean"] == pytest.approx(0.0, abs=2e-3)
    assert result["hausdorff_mm"] == pytest.approx(5.0, abs=1e-3)
    assert 5.0 <= result["hausdorff_upper_mm"] + 1e-4 <= 5.06
    assert result["mean_surface_distance_mm"] == pytest.approx(5.0, abs=1e-3)
    assert result["penetration"]["method"] == "winding number"
    assert not any(value for name, value in result["penetration"].items() if name != "method")
    assert result["normal_error_deg"]["max"] == pytest.approx(0.0, abs=1e-3)
    assert result["dihedral_error_deg"]["max"] == pytest.approx(0.0, abs=1e-3)
    assert result["edge_length_error"]["max"] == pytest.approx(0.0, abs=1e-5)
    assert result["self_intersections"]["pairs_max"] == result["body_intersections"]["pairs_max"] == 0
    assert (result["samples"], result["frames"]) == (2, 5)
    assert json.loads(compare(tmp_path / "prediction", tmp_path / "truth").to_json()) == result


def test_growing_speed_error(tmp_path, make_sample):
    truth = make_sample("a", frames=5)
    drift = np.arange(5)[:, None, None] * np.array([0.002, 0, 0])
    write_dataset(tmp_path / "t", [truth])
    write_dataset(tmp_path / "p", [shifted(truth, drift)])
    result = compare(tmp_path / "p", tmp_path / "t").to_dict()
    assert result["velocity_error_mm_s"]["mean"] == pytest.approx(60.0, abs=0.01)
    assert result["pairs"][0]["frames"]["vertex_mean"] == pytest.approx([0, 2, 4, 6, 8], abs=1e-4)


def test_penetration_of_a_sheet_through_the_sphere(tmp_path, make_sample):
    truth, cut = make_sample("a", n=41), make_sample("a", n=41, height=0.1)
    write_dataset(tmp_path / "t", [truth])
    write_dataset(tmp_path / "p", [cut])
    result = compare(tmp_path / "p", tmp_path / "t").to_dict()
    radii = np.linalg.norm(cut.positions[0], axis=1)
    assert result["penetration"]["ratio"] == pytest.approx((radii < 0.2).mean(), abs=0.01)
    assert result["penetration"]["depth_max_mm"] == pytest.approx(100.0, abs=1.0)
    assert result["truth_penetration"]["ratio"] == 0.0


def test_matching_by_key_when_ids_differ(tmp_path, make_sample):
    write_dataset(
        tmp_path / "t", [make_sample("one"), make_sample("two", frames=2), make_sample("x", fabric="wool")]
    )
    write_dataset(tmp_path / "p", [make_sample("b", frames=2), make_sample("c")])
    result = compare(tmp_path / "p", tmp_path / "t")
    assert {(pair.prediction, pair.truth) for pair in result.pairs} == {("b", "two"), ("c", "one")}
    assert result.unmatched_truth == ["x"]
    assert result.figures["vertex_error_mm"]["max"] == 0.0


def test_single_sample_folder(tmp_path, make_sample):
    write_dataset(tmp_path / "t", [make_sample("one"), make_sample("two", height=0.3)])
    samples = tmp_path / "t" / "samples"
    result = compare(samples / "one.zarr.zip", samples / "two.zarr.zip")
    assert result.figures["vertex_error_mm"]["mean"] == pytest.approx(90.0, abs=1e-3)


def test_quad_of_other_topology_has_surface_distances_only(tmp_path):
    a = write(tmp_path / "a.obj", QUAD + "f 1 2 3\nf 1 3 4\n")
    b = write(tmp_path / "b.obj", QUAD + "f 1 2 4\nf 2 3 4\n")
    result = compare(a, b).to_dict()
    assert result["vertex_error_mm"] is None
    assert result["penetration"] is None
    assert any("topology" in note for note in result["notes"])
    exact = 200 / np.sqrt(1.08)
    assert result["hausdorff_mm"] <= exact + 1e-9
    assert result["hausdorff_upper_mm"] >= exact - 1e-9
    assert result["hausdorff_mm"] > 190.0
    assert result["mean_surface_distance_mm"] == pytest.approx(64.15, abs=0.5)


def test_obj_sequences_need_a_rate_for_velocities(tmp_path):
    for t in range(3):
        write(tmp_path / f"a/{t:03}.obj", f"v 0 0 {t}\nv 1 0 {t}\nv 0 1 {t}\nf 1 2 3\n")
        write(tmp_path / f"b/{t:03}.obj", f"v 0 0 {2 * t}\nv 1 0 {2 * t}\nv 0 1 {2 * t}\nf 1 2 3\n")
    assert compare(tmp_path / "a", tmp_path / "b").figures["velocity_error_mm_s"] is None
    with_rate = compare(tmp_path / "a", tmp_path / "b", fps=10.0)
    assert with_rate.figures["velocity_error_mm_s"]["mean"] == pytest.approx(10_000.0)


def test_an_obj_sequence_against_a_dataset_asks_for_the_rate(tmp_path, make_sample):
    sample = make_sample("a", frames=3)
    write_dataset(tmp_path / "t", [sample])
    for t, positions in enumerate(sample.positions):
        mesh = trimesh.Trimesh(positions, sample.garment.faces, process=False)
        (tmp_path / "p").mkdir(exist_ok=True)
        mesh.export(tmp_path / f"p/{t}.obj")
    with pytest.raises(InputError, match=rf"p: the frame rate .* --fps {sample.fps:g}$"):
        compare(tmp_path / "p", tmp_path / "t")
    assert compare(tmp_path / "p", tmp_path / "t", fps=sample.fps).frames == 3


def test_few_surface_frames_are_said(tmp_path, make_sample):
    write_dataset(tmp_path / "t", [make_sample("a", frames=9)])
    result = compare(tmp_path / "t", tmp_path / "t", surface_frames=3)
    assert result.pairs[0].frames["surface_frames"] == [0, 4, 8]
    assert any("some frames of a sequence only" in note for note in result.notes)


def test_obj_reader_keeps_seam_vertices_and_fans_polygons(tmp_path):
    text = QUAD + "vt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\nvt 0.5 0.5\nv 9 9 9\nf 1/1 2/2 3/3 4/4\nf -1/5 -2/5 -3/5\n"
    read = read_mesh(write(tmp_path / "q.obj", text))
    vertices, faces = read.vertices, read.faces
    assert vertices.shape == (5, 3)
    assert faces.tolist() == [[0, 1, 2], [0, 2, 3], [4, 3, 2]]


def test_ply_round_trip(tmp_path):
    ball = trimesh.creation.icosphere(1)
    ball.export(tmp_path / "b.ply")
    read = read_mesh(tmp_path / "b.ply")
    vertices, faces = read.vertices, read.faces
    assert np.array_equal(faces, ball.faces)
    assert vertices == pytest.approx(np.array(ball.vertices), abs=1e-6)


@pytest.mark.parametrize(
    ("text", "says"),
    [
        (QUAD, "empty"),
        (QUAD + "f 1 2 9\n", "1 to 4"),
        (QUAD.replace("0.2", "nan") + "f 1 2 3\n", "NaN"),
        (QUAD.replace("0.2", "inf") + "f 1 2 3\n", "infinite"),
        (QUAD + "v 2 2 2\nf 1 2 3\nf 1 2 4\nf 1 2 5\n", "not manifold"),
        (QUAD + "f 1 2\n", "line 5"),
        ("v 0 0 zero\n", "line 1"),
    ],
)
def test_bad_meshes_are_named(tmp_path, text, says):
    good = write(tmp_path / "good.obj", QUAD + "f 1 2 3\n")
    bad = write(tmp_path / "bad.obj", text)
    with pytest.raises(InputError, match=says):
        compare(bad, good)


def test_missing_empty_and_unlike_inputs(tmp_path, make_sample):
    good = write(tmp_path / "good.obj", QUAD + "f 1 2 3\n")
    (tmp_path / "nothing").mkdir()
    write_dataset(tmp_path / "t", [make_sample("a", frames=3)])
    write_dataset(tmp_path / "short", [make_sample("a", frames=2)])
    write_dataset(tmp_path / "other", [make_sample("x", fabric="wool"), make_sample("y", fabric="silk")])
    for prediction, truth, says in (
        (tmp_path / "none.obj", good, "no such file"),
        (tmp_path / "nothing", good, "neither a dataset"),
        (write(tmp_path / "a.txt", "hello"), good, "no mesh format"),
        (tmp_path / "short", tmp_path / "t", "3"),
        (tmp_path / "other", tmp_path / "t", "no sample in common"),
    ):
        with pytest.raises(InputError, match=says):
            compare(prediction, truth)


def test_check_mesh_accepts_a_closed_and_an_open_mesh():
    ball = trimesh.creation.icosphere(1)
    check_mesh(np.array(ball.vertices), np.array(ball.faces), "ball")
    check_mesh(np.zeros((2, 3, 3)), np.array([[0, 1, 2]]), "two frames")
