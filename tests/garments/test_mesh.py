"""GarmentMesh: topology of small meshes, and one clear error for each way a mesh can be unsound."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from muslin.garments.errors import InputError
from muslin.garments.mesh import GarmentMesh, corner_angles, validate_manifold


def flat(points: list[list[float]], faces: list[list[int]]) -> GarmentMesh:
    """One panel, unsewn."""
    vertices, triangles = np.array(points, dtype=np.float64), np.array(faces, dtype=np.int32).reshape(-1, 3)
    return GarmentMesh(
        faces=triangles,
        panel_faces=triangles,
        panel_vertices=vertices,
        panel_to_vertex=np.arange(len(vertices), dtype=np.int32),
        face_panel=np.zeros(len(triangles), dtype=np.int32),
        panel_names=("panel",),
        uv=np.clip(vertices, 0.0, 1.0),
        name="test",
        parameters={},
    )


SQUARE = flat([[0, 0], [1, 0], [1, 1], [0, 1]], [[0, 1, 2], [0, 2, 3]])


def test_square() -> None:
    SQUARE.validate()
    assert SQUARE.num_vertices == 4
    np.testing.assert_array_equal(SQUARE.edges, [[0, 1], [0, 2], [0, 3], [1, 2], [2, 3]])
    assert SQUARE.euler_characteristic == 1
    (loop,) = SQUARE.boundary_loops
    assert np.roll(loop, -int(np.argmin(loop))).tolist() == [0, 1, 2, 3]
    np.testing.assert_allclose(SQUARE.face_areas, [0.5, 0.5])
    np.testing.assert_allclose(SQUARE.vertex_areas, [1 / 3, 1 / 6, 1 / 3, 1 / 6])
    np.testing.assert_array_equal(SQUARE.panel_vertex_panel, 0)
    np.testing.assert_allclose(
        np.degrees(corner_angles(SQUARE.panel_vertices, SQUARE.faces)), [[45, 90, 45], [45, 45, 90]]
    )


TETRAHEDRON = [[0, 1, 2], [0, 3, 1], [0, 2, 3], [1, 3, 2]]
NAN = SQUARE.panel_vertices.copy()
NAN[2, 1] = np.nan
TWISTED = SQUARE.panel_vertices[[0, 1, 3, 2]]
NONE = np.empty((0, 3), np.int32)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"faces": NONE, "panel_faces": NONE}, "is empty: 0 faces"),
        ({"panel_vertices": NAN}, r"panel_vertices\[2\] is NaN or infinite"),
        ({"uv": NAN}, r"uv\[2\] is NaN"),
        ({"uv": SQUARE.uv + 0.5}, r"uv ranges over 0\.5 to 1\.5; allowed: 0 to 1"),
        ({"panel_vertices": TWISTED}, r"1 panel triangles are inverted or empty, first 1 with area -0\.5"),
        ({"panel_vertices": SQUARE.panel_vertices * [1, 0]}, "inverted or empty"),
        ({"panel_faces": SQUARE.panel_faces + 2}, "panel_faces holds index 5; allowed: 0 to 3"),
        ({"panel_faces": SQUARE.panel_faces - 1}, "panel_faces holds index -1"),
        ({"faces": SQUARE.faces[:, [1, 2, 0]]}, "faces and panel_faces disagree"),
        ({"face_panel": np.ones(2, np.int32)}, "face_panel holds index 1; allowed: 0 to 0"),
        ({"face_panel": np.array([0, 1], np.int32), "panel_names": ("a", "b")}, "belongs to two panels"),
        ({"uv": SQUARE.uv[:3]}, r"uv has shape \(3, 2\); it must be \(4, 2\)"),
    ],
)  # fmt: skip
def test_unsound_arrays_are_refused(change: dict[str, Any], message: str) -> None:
    with pytest.raises(InputError, match=message):
        replace(SQUARE, **change).validate()


def test_unused_vertex_is_refused() -> None:
    with pytest.raises(InputError, match="belongs to no triangle"):
        flat([[0, 0], [1, 0], [0, 1], [1, 1]], [[0, 1, 2]]).validate()


@pytest.mark.parametrize(
    ("faces", "message"),
    [
        ([[0, 1, 2], [1, 0, 3], [0, 1, 4]], "edge 0-1 is used twice in one direction"),
        ([[0, 1, 2], [0, 1, 3]], "edge 0-1 is used twice"),
        ([[0, 1, 1]], "face 0 names a vertex twice"),
        ([[0, 1, 2], [0, 3, 4]], "vertex 0 joins 2 separate fans"),
        # Two closed fans (tetrahedra) that touch in a vertex.
        ([*TETRAHEDRON, [0, 4, 5], [0, 6, 4], [0, 5, 6], [4, 6, 5]], "vertex 0 joins 2"),
    ],
)  # fmt: skip
def test_non_manifold_faces_are_refused(faces: list[list[int]], message: str) -> None:
    with pytest.raises(InputError, match=message):
        validate_manifold(np.array(faces, dtype=np.int32), "mesh")


def test_manifold_faces_pass() -> None:
    tetrahedron = np.array(TETRAHEDRON, dtype=np.int32)
    validate_manifold(tetrahedron, "closed")
    validate_manifold(tetrahedron[:2], "open")
