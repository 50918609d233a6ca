"""Mesh files of one frame: what is read from each format, and what is refused."""

from __future__ import annotations

import json
import struct
import tracemalloc
from pathlib import Path

import numpy as np
import pytest
import trimesh

from muslin.eval.read.meshes import read_mesh
from muslin.garments.errors import InputError

from .conftest import write_obj


def glb(tree: dict, binary: bytes = b"") -> bytes:
    text = json.dumps(tree).encode()
    text += b" " * (-len(text) % 4)
    chunks = struct.pack("<I4s", len(text), b"JSON") + text
    if binary:
        chunks += struct.pack("<I4s", len(binary), b"BIN\0") + binary
    return struct.pack("<4sII", b"glTF", 2, 12 + len(chunks)) + chunks


@pytest.mark.parametrize("suffix", ["ply", "off", "glb", "obj"])
def test_vertices_and_faces_are_those_of_the_file(tmp_path, scene, suffix):
    path = tmp_path / f"sheet.{suffix}"
    if suffix == "obj":
        write_obj(path, scene.positions[0], scene.faces)
    else:
        trimesh.Trimesh(scene.positions[0], scene.faces, process=False).export(path)
    found = read_mesh(path)
    np.testing.assert_array_equal(found.faces, scene.faces)
    np.testing.assert_allclose(found.vertices, scene.positions[0], atol=1e-7)


@pytest.mark.parametrize("kind", ["stl", "stl_ascii"])
def test_corners_of_stl_are_sewn(tmp_path, scene, kind):
    path = tmp_path / "sheet.stl"
    mesh = trimesh.Trimesh(scene.positions[0], scene.faces, process=False)
    mesh.export(path, file_type=kind)
    found = read_mesh(path)
    assert len(found.vertices) == len(scene.positions[0])
    np.testing.assert_allclose(found.vertices[found.faces], mesh.triangles, atol=1e-7)
    np.testing.assert_array_equal(
        np.unique(found.faces.ravel(), return_index=True)[0], range(len(found.vertices))
    )
    first = np.unique(found.faces.ravel(), return_index=True)[1]
    assert (np.diff(first) > 0).all(), "numbered by first appearance"


def test_parts_of_a_glb_are_told_apart_by_name(tmp_path, scene):
    parts = trimesh.Scene()
    moved = trimesh.transformations.translation_matrix([0, 0.5, 0])
    for name, vertices, faces in (
        ("body", scene.body, scene.body_faces),
        ("cloth", scene.positions[0] - [0, 0.5, 0], scene.faces),
    ):
        mesh = trimesh.Trimesh(vertices, faces, process=False)
        parts.add_geometry(mesh, node_name=name, geom_name=name, transform=moved if name == "cloth" else None)
    (tmp_path / "both.glb").write_bytes(parts.export(file_type="glb"))
    found = read_mesh(tmp_path / "both.glb")
    np.testing.assert_array_equal(found.faces, scene.faces)
    np.testing.assert_allclose(found.vertices, scene.positions[0], atol=1e-6)
    assert found.body is not None
    np.testing.assert_allclose(found.body.vertices, scene.body, atol=1e-7)


@pytest.mark.parametrize(
    ("name", "content", "says"),
    [
        ("a.ply", b"ply\nformat ascii 1.0\nelement vertex 4000000000\nend_header\n", "4000000000"),
        ("a.ply", b"ply\nformat ascii 1.0\nelement vertex -1\nend_header\n", "-1"),
        ("a.ply", b"ply\nformat ascii 1.0\nelement vertex many\nend_header\n", "no count"),
        ("a.ply", b"plx\n", "must begin with 'ply'"),
        ("a.ply", b"ply\nformat ascii 1.0\n", "no end"),
        ("a.off", b"OFF\n900000000 1 0\n0 0 0\n", "900000000"),
        ("a.off", b"OFF\n3\n", "no counts"),
        ("a.off", b"3 1 0\n", "must begin with OFF"),
        ("a.stl", b"\0" * 80 + struct.pack("<I", 4_000_000_000), "4000000000 triangles"),
        ("a.stl", b"solid x\nfacet\nvertex 0 0\n", "3 numbers"),
        ("a.stl", b"solid x\nfacet\nvertex 0 0 0\nendfacet\nendsolid\n", "3 vertices"),
        ("a.stl", b"", "not an STL"),
        ("a.glb", b"glTF" + struct.pack("<II", 2, 20), "not a GLB"),
        ("a.glb", glb({"asset": {}})[:-1], "header says"),
        ("a.glb", glb({"animations": [{}]}), "animated"),
        ("a.glb", glb({"extensionsRequired": ["KHR_draco_mesh_compression"]}), "compressed"),
        ("a.glb", glb({"accessors": [{"count": 10**12, "type": "VEC3"}]}), "1000000000000"),
        ("a.glb", glb({"asset": {"version": "2.0"}}), "no triangles|not readable"),
        ("a.obj", b"\xff\xfe\0", "text"),
        ("a.fbx", b"", "no mesh format"),
    ],
)  # fmt: skip
def test_damage_is_named_and_costs_no_memory(tmp_path, name, content, says):
    (tmp_path / name).write_bytes(content)
    tracemalloc.start()
    try:
        with pytest.raises(InputError, match=says) as caught:
            read_mesh(tmp_path / name)
        assert tracemalloc.get_traced_memory()[1] < 20e6
    finally:
        tracemalloc.stop()
    assert name in str(caught.value)
    assert "\n" not in str(caught.value)


def test_a_fan_of_three_faces_at_an_edge_is_refused(tmp_path):
    path = tmp_path / "fan.obj"
    vertices = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1], [0, -1, 0]], dtype=float)
    write_obj(path, vertices, np.array([[0, 1, 2], [0, 1, 3], [1, 0, 4]]))
    with pytest.raises(InputError, match="edge of vertices 0 and 1 has 3 faces"):
        read_mesh(Path(path))
