"""The judge of the benchmarks finds what is wrong with a frame, and nothing else."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from benchmarks.contenders.record import FRAMES_FILE, RECORD_FILE, Record
from benchmarks.garment import garment
from benchmarks.judge import judge
from benchmarks.setting import Setting, load_setting

FRAMES = 3


@pytest.fixture
def setting() -> Setting:
    """A square of cloth a tenth of a metre above a body of one large triangle, which stands still."""
    square = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]])
    faces = np.array([[0, 1, 2], [0, 2, 3]], np.int32)
    positions = np.insert(square, 1, 0.1, axis=1)
    body = np.array([[-4.0, 0.0, -4.0], [-4.0, 0.0, 8.0], [8.0, 0.0, -4.0]])
    return Setting(
        positions=positions,
        faces=faces,
        panel_vertices=square,
        panel_faces=faces,
        free_positions=positions,
        mass=np.full(4, 0.05),
        body=np.repeat(body[None], FRAMES + 1, axis=0),
        body_faces=np.array([[0, 1, 2]], np.int32),
        hidden=np.zeros((FRAMES + 1, 1), bool),
        density=np.array(0.2),
        stretch=np.array([20.0, 0.0, 30.0, 40.0]),
        bend=np.full(3, 1e-5),
        friction=np.array(0.3),
    )


def at_rest(setting: Setting) -> np.ndarray:
    return np.repeat(setting.positions[None], FRAMES, axis=0)


def test_cloth_at_rest_is_clean(setting: Setting) -> None:
    verdict = judge(setting, at_rest(setting))
    assert (verdict.intersecting, verdict.cloth_cloth, verdict.cloth_body, verdict.broken) == (0, 0, 0, 0)
    assert verdict.largest_stretch == pytest.approx(1.0)


def test_a_corner_through_the_body_is_counted(setting: Setting) -> None:
    frames = at_rest(setting)
    frames[1, 1, 1] = -0.1
    verdict = judge(setting, frames)
    # The two edges at corner 1 pass through the body's triangle.
    assert (verdict.intersecting, verdict.cloth_cloth, verdict.cloth_body) == (1, 0, 2)


def test_hidden_faces_are_left_out(setting: Setting) -> None:
    frames = at_rest(setting)
    frames[1, 1, 1] = -0.1
    setting.hidden[2] = True
    assert judge(setting, frames).cloth_body == 0


def test_stretch_is_against_the_panels(setting: Setting) -> None:
    frames = at_rest(setting)
    frames[2, :, 0] *= 1.3
    assert judge(setting, frames).largest_stretch == pytest.approx(1.3)


def test_frames_that_are_not_finite_are_counted_apart(setting: Setting) -> None:
    frames = at_rest(setting)
    frames[0, 0, 0] = np.nan
    verdict = judge(setting, frames)
    assert (verdict.broken, verdict.intersecting, verdict.frames) == (1, 0, FRAMES)


def test_missing_frames_are_refused(setting: Setting) -> None:
    with pytest.raises(ValueError, match="positions have shape"):
        judge(setting, at_rest(setting)[1:])


def test_a_setting_survives_its_file(setting: Setting, tmp_path: Path) -> None:
    file = tmp_path / "folder" / "setting.npz"
    setting.save(file)
    first = load_setting(file, 2)
    assert first.frames == 2
    np.testing.assert_array_equal(first.body, setting.body[:3])
    np.testing.assert_array_equal(first.panel_vertices, setting.panel_vertices)
    with pytest.raises(ValueError, match="holds 1 to 3"):
        load_setting(file, FRAMES + 1)


def test_its_cloth_is_a_valid_garment(setting: Setting) -> None:
    mesh = garment(setting)
    mesh.validate()
    np.testing.assert_array_equal(mesh.panel_to_vertex[mesh.panel_faces], mesh.faces)


def test_a_record_holds_a_time_for_each_frame(setting: Setting, tmp_path: Path) -> None:
    record = Record(("numpy",))
    for frame in at_rest(setting):
        with record.frame():
            sum(range(200_000))
        record.add(frame)
    record.save(tmp_path)
    written = json.loads((tmp_path / RECORD_FILE).read_text(encoding="utf-8"))
    assert len(written["seconds"]) == FRAMES
    assert min(written["seconds"]) > 0.0
    assert written["setup_seconds"] > 0.0
    assert written["versions"] == {"numpy": np.__version__}
    np.testing.assert_array_equal(np.load(tmp_path / FRAMES_FILE), at_rest(setting))
