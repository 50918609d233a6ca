"""What is packed is unpacked again, in numpy by the equations of encode.py, within its errors."""

import base64
import zlib

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from muslin.eval.viewer.encode import (
    CLOTH_RESOLUTION,
    differences,
    distinct_topologies,
    encode_mesh,
    pack,
    zigzag,
)
from muslin.eval.viewer.scene import MovingMesh


def unpacked(text: str, size: int) -> np.ndarray:
    """Numbers of `size` bytes out of their planes, low bytes first."""
    planes = np.frombuffer(zlib.decompress(base64.b64decode(text)), np.uint8).reshape(size, -1)
    return sum(planes[k].astype(np.int64) << (8 * k) for k in range(size))


def unzigzagged(numbers: np.ndarray) -> np.ndarray:
    return (numbers >> 1) ^ -(numbers & 1)


def restored(text: str, mesh: dict, axes: int, bits: int) -> list[np.ndarray]:
    """The whole numbers of every frame, (axes, V_t)."""
    numbers = unzigzagged(unpacked(text, bits // 8))
    frames: list[np.ndarray] = []
    start = 0
    for t, kind in enumerate(mesh["frames"]):
        count = mesh["topologies"][kind]["vertices"]
        change = np.cumsum(numbers[start : start + axes * count].reshape(axes, count), axis=1)
        same = t > 0 and mesh["frames"][t - 1] == kind
        frames.append((change + (frames[-1] if same else 0)) % 2**bits)
        start += axes * count
    assert start == len(numbers)
    return frames


def decoded_positions(mesh: dict) -> list[np.ndarray]:
    return [np.array(mesh["low"]) + mesh["step"] * q.T for q in restored(mesh["positions"], mesh, 3, 16)]


@pytest.mark.parametrize("resolution", [0.0, CLOTH_RESOLUTION, 1.0])
def test_positions_come_back_within_half_a_step(scenes, resolution) -> None:
    for scene in scenes:
        for mesh in scene.sides.values():
            encoded = encode_mesh(mesh, resolution)
            for back, positions in zip(decoded_positions(encoded), mesh.positions, strict=True):
                assert np.abs(back - positions).max() <= encoded["step"] / 2 * (1 + 1e-6)


def test_the_step_is_fine_enough_for_three_metres() -> None:
    corner = np.array([[0, 0, 0], [3, 0, 0], [0, 3, 3]], dtype=float)
    encoded = encode_mesh(MovingMesh([corner], [np.array([[0, 1, 2]])]))
    assert encoded["step"] / 2 <= 5e-5
    tiny = encode_mesh(MovingMesh([1e-3 * corner], [np.array([[0, 1, 2]])]))
    assert tiny["step"] <= 3e-3 / 4000  # a small thing is not drawn on a coarse grid


def test_values_come_back_within_the_stated_error(scenes) -> None:
    for scene in scenes:
        for mesh in scene.sides.values():
            encoded = encode_mesh(mesh)
            if mesh.values is None:
                assert encoded["values"] is None
                continue
            top = encoded["top"]
            assert top == max(v.max() for v in mesh.values)
            levels = restored(encoded["values"], encoded, 1, 8)
            for level, values in zip(levels, mesh.values, strict=True):
                bound = top * (np.sqrt(values / top) + 1 / 1020) / 255
                assert (np.abs(top * (level[0] / 255) ** 2 - values) <= bound * (1 + 1e-9)).all()


def test_faces_come_back(scenes) -> None:
    for scene in scenes:
        for mesh in scene.sides.values():
            encoded = encode_mesh(mesh)
            for t, kind in enumerate(encoded["frames"]):
                numbers = unzigzagged(unpacked(encoded["topologies"][kind]["data"], 4))
                np.testing.assert_array_equal(np.cumsum(numbers).reshape(-1, 3), mesh.faces[t])


def test_a_topology_is_stored_once_however_often_it_comes_back(scenes) -> None:
    changing = scenes[1].sides["truth"]
    distinct, of_frame = distinct_topologies([faces.copy() for faces in changing.faces])
    assert of_frame == [0, 0, 1, 1, 0, 0]
    assert [len(faces) for faces in distinct] == [len(changing.faces[0]), len(changing.faces[2])]


@given(st.lists(st.integers(-(2**15), 2**15 - 1), min_size=1), st.sampled_from([16, 32]))
def test_zigzag_and_pack_are_inverted(numbers, bits) -> None:
    array = np.array(numbers, dtype=np.int64)
    coded = zigzag(array, bits)
    assert (coded.astype(np.int64) <= 2 * np.abs(array)).all()  # small stays small
    np.testing.assert_array_equal(unzigzagged(unpacked(pack(coded, bits // 8), bits // 8)), array)


def test_no_motion_and_no_error_cost_next_to_nothing() -> None:
    points = np.random.default_rng(0).normal(size=(500, 3))
    faces = np.arange(498)[:, None] + np.arange(3)

    def length(frames: int) -> int:
        still = MovingMesh([points] * frames, [faces] * frames, [np.zeros(500)] * frames)
        encoded = encode_mesh(still)
        return len(encoded["positions"]) + len(encoded["values"])

    assert length(50) - length(1) < 0.05 * 49 * length(1)


def test_one_point_in_place_has_a_step() -> None:
    mesh = encode_mesh(MovingMesh([np.ones((3, 3))], [np.array([[0, 1, 2]])]))
    np.testing.assert_array_equal(decoded_positions(mesh)[0], np.ones((3, 3)))
    assert (differences(np.array([[5, 4, 7]])) == [10, 1, 6]).all()
