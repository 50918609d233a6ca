"""NumPy files: names, shapes, memory, and headers that lie."""

from __future__ import annotations

import io
import struct
import tracemalloc
import zipfile

import numpy as np
import pytest

from muslin.eval.read.options import ReadOptions
from muslin.eval.read.subject import open_subject
from muslin.garments.errors import InputError

from .conftest import assert_lies_on, assert_shows, write_obj


def load(path, **how):
    subject = open_subject(path, options=ReadOptions(**how))
    return subject.load(subject.ids[0])


@pytest.mark.parametrize(
    ("vertices", "faces"),
    [
        ("vertices", "faces"),
        ("verts", "F"),
        ("Positions", "Tris"),
        ("pred", "cloth_faces"),
        ("X", "triangles"),
    ],
)
def test_names_of_vertices_and_faces(tmp_path, scene, vertices, faces):
    np.savez(tmp_path / "a.npz", **{vertices: scene.positions, faces: scene.faces, "loss": np.zeros(3)})
    assert_shows(load(tmp_path / "a.npz"), scene)


def test_a_body_and_a_rate_in_an_npz(tmp_path, scene):
    np.savez_compressed(
        tmp_path / "a.npz",
        vertices=scene.positions[None].astype(">f8"),
        faces=scene.faces.astype(np.float32),
        body_vertices=scene.moving_body,
        body_faces=scene.body_faces[None],
        fps=np.array(50),
    )
    track = load(tmp_path / "a.npz", fps=30.0)
    assert_shows(track, scene)
    assert_lies_on(track, scene)
    assert track.fps == 50.0
    assert any("says 50" in note and "30" in note for note in track.notes)


def test_quads_are_split(tmp_path):
    np.savez(tmp_path / "q.npz", vertices=np.eye(4, 3), faces=np.array([[0, 1, 2, 3]]))
    assert load(tmp_path / "q.npz").faces[0].tolist() == [[0, 1, 2], [0, 2, 3]]


def test_an_npy_takes_its_faces_from_beside_it_or_from_a_mesh(tmp_path, scene):
    np.save(tmp_path / "pred.npy", scene.positions)
    assert load(tmp_path / "pred.npy").faces == []
    mesh = write_obj(tmp_path / "template/t.obj", scene.positions[0], scene.faces)
    assert_shows(load(tmp_path / "pred.npy", faces=mesh), scene)
    np.save(tmp_path / "faces.npy", scene.faces)
    assert_shows(load(tmp_path / "pred.npy"), scene)
    assert open_subject(tmp_path).ids == (tmp_path.name, "pred")[1:]


def test_arrays_of_one_frame_each_are_a_sequence(tmp_path, scene):
    (tmp_path / "walk").mkdir()
    for t, x in enumerate(scene.positions):
        np.save(tmp_path / f"walk/{t}.npy", x)
    np.save(tmp_path / "walk/faces.npy", scene.faces)
    assert_shows(load(tmp_path / "walk"), scene)


def test_a_long_npy_is_mapped_not_read(tmp_path):
    np.save(tmp_path / "long.npy", np.zeros((2000, 1000, 3), dtype=np.float32))  # 24 MB
    tracemalloc.start()
    track = load(tmp_path / "long.npy")
    assert sum(float(x.sum()) for x in track.positions) == 0.0
    assert tracemalloc.get_traced_memory()[1] < 2e6
    tracemalloc.stop()


def header(shape: str, descr: str = "<f4") -> bytes:
    text = f"{{'descr': '{descr}', 'fortran_order': False, 'shape': {shape}, }}".encode()
    text += b" " * (63 - (10 + len(text)) % 64) + b"\n"
    return b"\x93NUMPY\x01\x00" + struct.pack("<H", len(text)) + text


@pytest.mark.parametrize(
    ("content", "says"),
    [
        (b"", "not readable"),
        (b"\x93NUMPY\x01\x00\xff\xff{", "not readable"),
        (b"\x93NUMPY\x09\x00" + header("(1, 3, 3)")[8:], r"version \(9, 0\)|not readable"),
        (header("(1000000, 1000000, 3)"), "its header asks for 12000000000"),
        (header("(1, 2, 3)") + b"\0" * 23, "asks for"),
        (header("(1, 2, 3)") + b"\0" * 25, "asks for"),
        (header("(1, 2, 3)", "|O"), "plain numbers"),
        (header("(2, 2)") + b"\0" * 16, "shape"),
        (header("(0, 3, 3)"), "empty"),
        (header("(1, 2, 3)", "<c8") + b"\0" * 48, "plain numbers"),
    ],
)
def test_npy_headers_that_lie(tmp_path, content, says):
    (tmp_path / "a.npy").write_bytes(content)
    tracemalloc.start()
    with pytest.raises(InputError, match=says):
        load(tmp_path / "a.npy")
    assert tracemalloc.get_traced_memory()[1] < 5e6
    tracemalloc.stop()


@pytest.mark.parametrize(
    ("member", "zeros", "says"),
    [(header("(1000000, 1000000, 3)"), 0, "asks for"), (header("(25, 1000000, 3)"), 300, "refused")],
)
def test_npz_members_that_lie(tmp_path, member, zeros, says):
    with (
        zipfile.ZipFile(tmp_path / "a.npz", "w", zipfile.ZIP_DEFLATED, compresslevel=1) as archive,
        archive.open("vertices.npy", "w", force_zip64=True) as stream,
    ):
        stream.write(member)
        for _ in range(zeros):
            stream.write(bytes(1_000_000))
    tracemalloc.start()
    with pytest.raises(InputError, match=says):
        load(tmp_path / "a.npz")
    assert tracemalloc.get_traced_memory()[1] < 5e6
    tracemalloc.stop()


def test_an_npz_with_objects_runs_nothing(tmp_path):
    buffer = io.BytesIO()
    np.save(buffer, np.array([{"a": 1}], dtype=object), allow_pickle=True)
    with zipfile.ZipFile(tmp_path / "a.npz", "w") as archive:
        archive.writestr("vertices.npy", buffer.getvalue())
    with pytest.raises(InputError, match="plain numbers"):
        load(tmp_path / "a.npz")


def test_an_npz_without_vertices_lists_what_is_there(tmp_path):
    np.savez(tmp_path / "a.npz", latent=np.zeros(8), joints=np.zeros((24, 3)))
    with pytest.raises(InputError, match=r"latent, joints; name it 'vertices'"):
        load(tmp_path / "a.npz")


@pytest.mark.parametrize(
    ("faces", "says"),
    [
        (np.array([[0, 1, 2.5]]), "no indices"),
        (np.array([[0, 1]]), "shape"),
        (np.array([[[0, 1, 2]], [[0, 2, 1]]]), "changes over time"),
        (np.array([["a", "b", "c"]]), "indices"),
    ],
)
def test_faces_that_are_none(tmp_path, faces, says):
    np.savez(tmp_path / "a.npz", vertices=np.zeros((2, 3, 3)), faces=faces)
    with pytest.raises(InputError, match=says):
        load(tmp_path / "a.npz")
