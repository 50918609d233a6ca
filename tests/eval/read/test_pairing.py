"""Two sides of a comparison: borrowed faces, units, the body, and what is asked for."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from muslin.eval.read.options import ReadOptions
from muslin.eval.read.pairing import paired
from muslin.eval.read.subject import open_subject
from muslin.eval.read.track import Frames, MovingSurface, Track
from muslin.garments.errors import InputError

from .conftest import assert_lies_on, assert_shows, write_obj


def track(name, scene, faces=True, **changes) -> Track:
    shared = [scene.faces] * len(scene.positions) if faces else []
    made = Track(name, Frames(len(scene.positions), lambda t: scene.positions[t]), shared)
    return replace(made, **changes)


@pytest.mark.parametrize("bare", ["prediction", "truth"])
def test_vertices_without_faces_take_those_of_the_other_side(scene, bare):
    sides = {name: track(name, scene, faces=name != bare) for name in ("prediction", "truth")}
    pair = paired(sides["prediction"], sides["truth"])
    assert_shows(pair.prediction, scene)
    assert_shows(pair.truth, scene)
    assert any(bare in note and "without faces" in note for note in pair.notes)


def test_faces_are_not_borrowed_where_counts_differ(scene):
    fewer = replace(track("p", scene, faces=False), positions=[x[:-1] for x in scene.positions])
    with pytest.raises(InputError, match=r"p: 35 vertices without faces, and t has 36 .*--faces"):
        paired(fewer, track("t", scene))
    with pytest.raises(InputError, match="neither p nor t has faces"):
        paired(track("p", scene, faces=False), track("t", scene, faces=False))


@pytest.mark.parametrize(
    ("scale", "says"),
    [
        (100.0, r"p: the garment is 113 m .*centimetres: give --scale 0\.01"),
        (1000.0, r"millimetres: give --scale 0\.001"),
        (0.01, "5 to 20 m"),
        (10.0, r"p is 11\.3 m across and t 1\.13 m.*--scale 0\.1 "),
        (0.1, r"p is 0\.113 m .*--scale 10 "),
    ],
)
def test_units_that_look_wrong(scene, scale, says):
    wrong = track("p", replace(scene, positions=scene.positions * np.float32(scale)))
    with pytest.raises(InputError, match=says):
        paired(wrong, track("t", scene))
    told = replace(wrong, units_known=True)
    assert paired(told, track("t", scene)).prediction is told


def test_a_truth_in_centimetres_names_its_own_option(scene):
    wrong = track("t", replace(scene, positions=scene.positions * np.float32(100)))
    with pytest.raises(InputError, match=r"--truth-scale 0\.01"):
        paired(track("p", scene), wrong)


def test_twice_the_size_is_an_error_of_the_prediction_not_of_its_unit(scene):
    paired(track("p", replace(scene, positions=scene.positions * np.float32(2.5))), track("t", scene))


def test_scale_and_up_turn_a_file_into_metres_y_up(tmp_path, scene):
    z_up = 100.0 * scene.positions[..., [0, 2, 1]] * np.float32([1, -1, 1])
    body = 100.0 * scene.body[..., [0, 2, 1]] * np.float32([1, -1, 1])
    np.savez(tmp_path / "a.npz", verts=z_up, faces=scene.faces, body=body, body_faces=scene.body_faces)
    loaded = open_subject(tmp_path / "a.npz", options=ReadOptions(scale=0.01, up="z")).load("a")
    assert_shows(loaded, scene, 1e-6)
    assert_lies_on(loaded, scene)
    assert loaded.units_known


@pytest.mark.parametrize("options", [{"scale": 0.0}, {"scale": -1.0}, {"fps": float("nan")}, {"up": "x"}])
def test_options_that_make_no_sense(options):
    with pytest.raises(InputError, match="must be"):
        ReadOptions(**options)


def test_the_truths_body_counts_and_else_the_predictions(tmp_path, scene):
    np.savez(
        tmp_path / "p.npz",
        vertices=scene.positions,
        faces=scene.faces,
        obstacle=scene.moving_body,
        obstacle_faces=scene.body_faces,
    )
    prediction = open_subject(tmp_path / "p.npz").load("p")
    pair = paired(prediction, track("t", scene))
    assert pair.body is prediction.body
    assert_lies_on(pair.truth, scene)
    assert any("body in p" in note for note in pair.notes)
    write_obj(tmp_path / "body.obj", scene.body, scene.body_faces)
    write_obj(tmp_path / "t.obj", scene.positions[0], scene.faces)
    given = ReadOptions(body=tmp_path / "body.obj")
    truth = open_subject(tmp_path / "t.obj", options=given).load("t")
    assert_lies_on(truth, scene)
    one = replace(prediction, positions=prediction.positions[:1], faces=prediction.faces[:1])
    assert paired(one, truth).body is truth.body


def test_a_body_may_be_open_but_not_of_another_length(scene):
    body = MovingSurface("ball", [scene.body] * 3, scene.body_faces[1:])
    assert not body.closed
    with pytest.raises(InputError, match="ball has 3 frames and t has 4"):
        paired(track("p", scene), track("t", scene, body=body))
    still = MovingSurface("ball", [scene.body], scene.body_faces[1:])
    assert paired(track("p", scene), track("t", scene, body=still)).body is still


@pytest.mark.parametrize(
    ("change", "says"),
    [
        (lambda x: x[:3], "p has 3 frames and t has 4"),
        (lambda x: np.where(np.arange(len(x))[:, None, None] == 2, np.nan, x), "p, frame 2: NaN"),
        (lambda x: [*x[:3], x[3][:5]], "p, frame 3: has 5 vertices"),
    ],
)
def test_frames_that_are_none(scene, change, says):
    changed = change(scene.positions)
    prediction = replace(track("p", scene), positions=Frames(len(changed), lambda t: changed[t]))
    with pytest.raises(InputError, match=says):
        paired(prediction, track("t", scene))


def test_frames_are_read_again_at_every_access():
    reads = []
    frames = Frames(3, lambda t: reads.append(t) or np.full((2, 3), t, dtype=np.float16))
    assert frames[-1].tolist() == [[2.0] * 3] * 2
    assert [x[0, 0] for x in frames[1:]] == [1.0, 2.0]
    assert reads == [2, 1, 2]
    with pytest.raises(IndexError):
        frames[3]
