"""AMASS files: round trips, the change of the up axis, and every wrong kind of file."""

from __future__ import annotations

import zipfile
from pathlib import Path

import numpy as np
import pytest

from muslin.garments.errors import InputError
from muslin.sim.motion import Motion, load_motion, motion_names, read_amass, write_amass
from muslin.sim.motion.amass import POSE_QUANTUM, SMPLH_PELVIS, SMPLX_PELVIS, TRANSLATION_QUANTUM
from muslin.sim.motion.rotations import matrix_from_quaternion, quaternion_from_axis_angle, rotate

RNG = np.random.default_rng(9)
T = 7
Y_UP = np.array([[1.0, 0, 0], [0, 0, 1], [0, -1, 0]])  # (x, y, z) of z up to (x, z, -y)


def smplh(**changes: object) -> dict[str, object]:
    arrays: dict[str, object] = {
        "poses": RNG.normal(scale=0.3, size=(T, 156)),
        "trans": RNG.normal(size=(T, 3)),
        "betas": np.zeros(16),
        "dmpls": np.zeros((T, 8)),
        "gender": np.array(b"female"),
        "mocap_framerate": np.array(120.0),
    }
    arrays.update(changes)
    return {key: value for key, value in arrays.items() if value is not None}


def saved(path: Path, arrays: dict[str, object]) -> Path:
    np.savez(path, **arrays)  # type: ignore[arg-type]
    return path


def test_smplh_joints_are_the_first_22_and_the_hands_are_straight(tmp_path: Path) -> None:
    arrays = smplh()
    motion = read_amass(saved(tmp_path / "a.npz", arrays))
    poses = np.asarray(arrays["poses"])
    assert (motion.num_frames, motion.fps, motion.name) == (T, 120.0, "a")
    np.testing.assert_array_equal(motion.poses[:, 1:22].reshape(T, -1), poses[:, 3:66])
    assert not motion.poses[:, 22:].any()


def test_a_point_of_the_body_goes_where_the_file_puts_it_with_y_up(tmp_path: Path) -> None:
    """C (R (x - J) + J + t), the file's placement turned y up, for a body of the same pelvis and any x."""
    arrays = smplh()
    motion = read_amass(saved(tmp_path / "a.npz", arrays), SMPLH_PELVIS)
    x = np.array([0.3, 0.5, -0.2])
    in_file = matrix_from_quaternion(quaternion_from_axis_angle(np.asarray(arrays["poses"])[:, :3]))
    expected = (in_file @ (x - SMPLH_PELVIS) + SMPLH_PELVIS + np.asarray(arrays["trans"])) @ Y_UP.T
    ours = rotate(motion.quaternions[:, 0], x - SMPLH_PELVIS) + SMPLH_PELVIS + motion.translations
    np.testing.assert_allclose(ours, expected, atol=1e-12)


def test_an_upright_amass_figure_stands_upright(tmp_path: Path) -> None:
    poses = np.zeros((1, 156))
    poses[0, 0] = 0.5 * np.pi  # z up: the root of a standing body is turned by 90 degrees about x
    motion = read_amass(saved(tmp_path / "a.npz", smplh(poses=poses, trans=np.array([[0.0, 0.0, 1.2]]))))
    np.testing.assert_allclose(motion.poses, 0.0, atol=1e-12)
    np.testing.assert_allclose(motion.pelvis[0, 1], 1.2 + SMPLH_PELVIS[2])


def test_smplx_reads_whole_and_split_poses_alike(tmp_path: Path) -> None:
    poses = RNG.normal(scale=0.3, size=(T, 165))
    rate = {"mocap_framerate": None, "mocap_frame_rate": np.array(30.0), "trans": np.ones((T, 3))}
    whole = read_amass(saved(tmp_path / "whole.npz", smplh(poses=poses, **rate)))
    split = {"root_orient": poses[:, :3], "pose_body": poses[:, 3:66], "pose_hand": poses[:, 75:]}
    parts = read_amass(saved(tmp_path / "parts.npz", smplh(poses=None, **rate, **split)))
    np.testing.assert_array_equal(whole.poses, parts.poses)
    np.testing.assert_array_equal(whole.translations, parts.translations)
    assert whole.fps == 30.0
    smplh_file = read_amass(saved(tmp_path / "h.npz", smplh(poses=poses[:, :156], trans=np.zeros((T, 3)))))
    smplx_file = read_amass(saved(tmp_path / "x.npz", smplh(poses=poses, trans=np.zeros((T, 3)))))
    difference = (smplx_file.pelvis - smplh_file.pelvis)[0]
    np.testing.assert_allclose(difference, Y_UP @ (SMPLX_PELVIS - SMPLH_PELVIS), atol=1e-15)


def test_smpl_poses_keep_their_hand_joints(tmp_path: Path) -> None:
    poses = RNG.normal(scale=0.3, size=(T, 72))
    motion = read_amass(saved(tmp_path / "a.npz", smplh(poses=poses)))
    np.testing.assert_array_equal(motion.poses[:, 1:].reshape(T, -1), poses[:, 3:])


def test_writing_and_reading_returns_the_motion_to_the_quantum(tmp_path: Path) -> None:
    poses = RNG.normal(scale=0.3, size=(T, 24, 3))
    poses[:, 22:] = 0.0
    motion = Motion("m", poses, RNG.normal(size=(T, 3)), 60.0, "a formula", (0.0, -0.2, 0.0))
    write_amass(tmp_path / "m.npz", motion)
    back = read_amass(tmp_path / "m.npz", motion.rest_pelvis)
    assert (back.fps, back.source) == (60.0, "a formula")
    np.testing.assert_allclose(back.poses[:, 1:], motion.poses[:, 1:], atol=0.51 * POSE_QUANTUM)
    np.testing.assert_allclose(back.poses[:, 0], motion.poses[:, 0], atol=2.0 * POSE_QUANTUM)
    np.testing.assert_allclose(back.translations, motion.translations, atol=0.51 * TRANSLATION_QUANTUM)
    write_amass(tmp_path / "again.npz", motion)
    assert (tmp_path / "m.npz").read_bytes() == (tmp_path / "again.npz").read_bytes()


@pytest.mark.parametrize(
    ("changes", "says"),
    [
        ({"poses": None, "trans": None}, "body shape"),
        ({"poses": None, "trans": None, "markers_latent": np.zeros((40, 3))}, "stage-i"),
        ({"poses": None, "trans": None, "betas": None}, "no motion"),
        ({"trans": None}, "without `trans`"),
        ({"mocap_framerate": None}, "frame rate"),
        ({"mocap_framerate": np.array(0.0)}, "frames a second"),
        ({"poses": np.zeros((T, 63))}, r"shape \(7, 63\)"),
        ({"poses": np.zeros((0, 156)), "trans": np.zeros((0, 3))}, "no frames"),
        ({"trans": np.zeros((T + 1, 3))}, "trans has shape"),
        ({"poses": np.full((T, 156), np.nan)}, "NaN"),
        ({"trans": np.full((T, 3), np.inf)}, "inf"),
        ({"poses": np.array([None] * T)}, "Python objects"),
        ({"poses": np.full((T, 156), "a")}, "numbers are needed"),
    ],
)
def test_a_wrong_file_is_refused_by_name(tmp_path: Path, changes: dict[str, object], says: str) -> None:
    path = saved(tmp_path / "wrong_one.npz", smplh(**changes))
    with pytest.raises(InputError, match=says) as caught:
        read_amass(path)
    assert "wrong_one.npz" in str(caught.value)


@pytest.mark.parametrize("content", [b"", b"not a zip file", b"PK\x03\x04 half an archive"])
def test_an_unreadable_file_is_refused(tmp_path: Path, content: bytes) -> None:
    path = tmp_path / "broken.npz"
    path.write_bytes(content)
    with pytest.raises(InputError, match=r"broken\.npz"):
        read_amass(path)


def test_a_truncated_motion_is_refused(tmp_path: Path) -> None:
    path = saved(tmp_path / "cut.npz", smplh())
    path.write_bytes(path.read_bytes()[:-400])
    with pytest.raises(InputError, match=r"cut\.npz"):
        read_amass(path)


def test_a_damaged_array_is_refused(tmp_path: Path) -> None:
    path = saved(tmp_path / "flip.npz", smplh())
    data = bytearray(path.read_bytes())
    data[2000] ^= 0xFF
    path.write_bytes(bytes(data))
    with pytest.raises(InputError, match=r"flip\.npz"):
        read_amass(path)


@pytest.mark.parametrize("offset", [60, 100, 140])
def test_any_damage_to_a_compressed_motion_is_refused(tmp_path: Path, offset: int) -> None:
    path = tmp_path / "dent.npz"
    np.savez_compressed(path, **smplh())
    data = bytearray(path.read_bytes())
    data[offset : offset + 8] = b"\xff" * 8
    path.write_bytes(bytes(data))
    with pytest.raises(InputError, match=r"dent\.npz"):
        read_amass(path)


def test_a_header_that_is_no_python_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "header.npz"
    with zipfile.ZipFile(path, "w") as archive:
        for member in ("poses.npy", "trans.npy"):
            header = b"{'descr': ('<f4', 'fortran_order': False\n"
            archive.writestr(member, b"\x93NUMPY\x01\x00" + len(header).to_bytes(2, "little") + header)
    with pytest.raises(InputError, match=r"header\.npz: cannot be read"):
        read_amass(path)


def test_a_single_array_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "one.npz"
    with path.open("wb") as file:
        np.save(file, np.zeros((3, 156)))
    with pytest.raises(InputError, match="single array"):
        read_amass(path)


@pytest.mark.parametrize("name", ["no_such_clip", "missing.npz", "motion.bvh"])
def test_an_unknown_motion_is_refused_with_what_is_allowed(name: str) -> None:
    with pytest.raises(InputError, match=name) as caught:
        load_motion(name)
    assert "AMASS" in str(caught.value)


def test_clip_names_load_as_clips() -> None:
    assert load_motion("walk").name == "walk"
    assert {"walk", "dance_a", "cmu_01_01", "cmu_01_03"} <= set(motion_names())
