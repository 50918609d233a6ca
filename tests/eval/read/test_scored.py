"""From foreign files to figures: what is computed, and what is said where it cannot be."""

from __future__ import annotations

import pickle

import numpy as np
import pytest

from muslin.eval.compare import compare
from muslin.eval.read.options import ReadOptions

from .conftest import cache, write_obj

LIFT = np.array([0, 0.0625, 0], dtype=np.float32)  # exact in half precision


def vertex_error(result):
    found = result.to_dict()["vertex_error_mm"]
    return None if found is None else found["mean"]


def test_a_rollout_of_hood_against_a_folder_of_obj(tmp_path, scene):
    content = {
        "pred": scene.positions + LIFT,
        "cloth_faces": scene.faces,
        "obstacle": scene.moving_body,
        "obstacle_faces": scene.body_faces,
    }
    (tmp_path / "p.pkl").write_bytes(pickle.dumps(content))
    for t, x in enumerate(scene.positions):
        write_obj(tmp_path / f"t/{t}.obj", x, scene.faces)
    result = compare(tmp_path / "p.pkl", tmp_path / "t", fps=30.0, surface_frames=1)
    assert vertex_error(result) == pytest.approx(62.5, abs=1e-3)
    assert result.to_dict()["velocity_error_mm_s"]["max"] == pytest.approx(0.0, abs=1e-2)
    assert result.to_dict()["penetration"]["ratio"] == 0.0


def test_garments_of_cloth3d_one_by_one(tmp_path, scene):
    exact = np.round(scene.positions * 1024) / 1024
    for side, offset in (("p", LIFT), ("t", 0 * LIFT)):
        for garment in ("Tshirt", "Trousers"):
            write_obj(tmp_path / side / f"{garment}.obj", scene.positions[0], scene.faces)
            (tmp_path / side / f"{garment}.pc16").write_bytes(cache(exact + offset, "<f2"))
    result = compare(tmp_path / "p", tmp_path / "t", fps=30.0, surface_frames=1)
    assert [pair.truth for pair in result.pairs] == ["Trousers", "Tshirt"]
    assert vertex_error(result) == pytest.approx(62.5, abs=1e-9)
    assert any("relative to the body's root" in note for note in result.notes)


def test_correspondence_of_other_triangles_has_to_be_asked_for(tmp_path, scene):
    other = scene.faces.copy()
    quads = len(other) // 2
    a, b, c = other[0]
    d = other[quads][2]
    other[0], other[quads] = [a, b, d], [b, c, d]
    p = write_obj(tmp_path / "p.obj", scene.positions[0] + LIFT, other)
    t = write_obj(tmp_path / "t.obj", scene.positions[0], scene.faces)
    silent = compare(p, t)
    assert vertex_error(silent) is None
    assert any("--vertices-correspond" in note for note in silent.notes)
    assert vertex_error(compare(p, t, vertices_correspond=True)) == pytest.approx(62.5, abs=1e-4)


def test_the_same_triangles_in_another_order_correspond(tmp_path, scene):
    rng = np.random.default_rng(0)
    shuffled = np.roll(scene.faces, 1, axis=1)[rng.permutation(len(scene.faces))]
    p = write_obj(tmp_path / "p.obj", scene.positions[0] + LIFT, shuffled)
    t = write_obj(tmp_path / "t.obj", scene.positions[0], scene.faces)
    assert vertex_error(compare(p, t)) == pytest.approx(62.5, abs=1e-4)


def test_centimetres_z_up_with_a_body(tmp_path, scene):
    z_up = 100 * (scene.positions + LIFT)[..., [0, 2, 1]] * np.float32([1, -1, 1])
    np.save(tmp_path / "p.npy", z_up)
    np.savez(tmp_path / "t.npz", vertices=scene.positions, faces=scene.faces)
    body = write_obj(tmp_path / "body.obj", scene.body + 1.5 * LIFT, scene.body_faces)
    result = compare(
        tmp_path / "p.npy",
        tmp_path / "t.npz",
        surface_frames=1,
        prediction_options=ReadOptions(scale=0.01, up="z"),
        truth_options=ReadOptions(body=body),
    )
    assert vertex_error(result) == pytest.approx(62.5, abs=1e-3)
    assert result.to_dict()["truth_penetration"]["ratio"] > 0.0
