"""Colliders: closed, of the right size and the right way round, where the scene puts them."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import trimesh
from pydantic import TypeAdapter

from muslin.garments.errors import InputError
from muslin.sim.world.colliders import Colliders
from muslin.sim.world.tables import ColliderTable

TABLE: TypeAdapter[ColliderTable] = TypeAdapter(ColliderTable)


def colliders(*values: dict[str, Any]) -> Colliders:
    return Colliders([TABLE.validate_python(value) for value in values])


def mesh(*values: dict[str, Any]) -> trimesh.Trimesh:
    made = colliders(*values)
    return trimesh.Trimesh(made.at(0.0), made.faces, process=False)


@pytest.mark.parametrize(
    ("values", "volume", "low", "high"),
    [
        ({"shape": "sphere", "radius": 0.2}, 4 / 3 * np.pi * 0.2**3, (-0.2, -0.2, -0.2), (0.2, 0.2, 0.2)),
        ({"shape": "box", "size": [0.2, 0.4, 0.6]}, 0.048, (-0.1, -0.2, -0.3), (0.1, 0.2, 0.3)),
        (
            {"shape": "cylinder", "radius": 0.1, "height": 0.5},
            np.pi * 0.005,
            (-0.1, -0.25, -0.1),
            (0.1, 0.25, 0.1),
        ),
        ({"shape": "cone", "radius": 0.1, "height": 0.3}, np.pi * 0.001, (-0.1, 0.0, -0.1), (0.1, 0.3, 0.1)),
        (
            {"shape": "torus", "radius": 0.2, "rod": 0.05},
            2 * np.pi**2 * 0.2 * 0.05**2,
            (-0.25, -0.05, -0.25),
            (0.25, 0.05, 0.25),
        ),
    ],
)
def test_solids(values: dict[str, Any], volume: float, low: Any, high: Any) -> None:
    solid = mesh(values)
    assert solid.is_watertight
    assert solid.volume == pytest.approx(volume, rel=0.02), "positive: faces look outwards"
    np.testing.assert_allclose(solid.bounds, [low, high], atol=0.002)


def test_a_plane_faces_up() -> None:
    plane = mesh({"shape": "plane", "size": 2.0, "position": [0.0, 0.1, 0.0]})
    np.testing.assert_allclose(plane.face_normals, [[0, 1, 0], [0, 1, 0]], atol=1e-12)
    assert plane.area == pytest.approx(4.0)
    np.testing.assert_allclose(plane.vertices[:, 1], 0.1)


def test_position_rotation_and_copies() -> None:
    made = colliders(
        {
            "shape": "cone",
            "radius": 0.1,
            "height": 0.3,
            "position": [1.0, 2.0, 3.0],
            "rotation": [0.0, 0.0, np.pi / 2.0],
            "repeat": {"count": [2, 1, 3], "step": [0.5, 9.0, -0.25]},
        },
        {"shape": "sphere", "radius": 0.1, "subdivisions": 0},
    )
    points = made.at(0.0)
    cone = (len(points) - 12) // 6
    first = points[:cone]
    np.testing.assert_allclose(first[:, 0].min(), 1.0 - 0.3, atol=1e-12)
    for k, shift in enumerate([(x, 0, z) for x in (0.0, 0.5) for z in (0.0, -0.25, -0.5)]):
        np.testing.assert_allclose(points[k * cone : (k + 1) * cone], first + shift, atol=1e-12)
    assert made.faces.max() == len(points) - 1


def test_each_moves_on_its_own() -> None:
    still = {"shape": "sphere", "radius": 0.1, "subdivisions": 0}
    rolling = still | {"position": [1.0, 0.1, 0.0], "velocity": [0.5, 0.0, 0.0], "spin": [0.0, 0.0, -5.0]}
    made = colliders(still, rolling)
    assert made.moves
    begin, end = made.at(0.0), made.at(2.0)
    np.testing.assert_array_equal(end[:12], begin[:12])
    np.testing.assert_allclose(end[12:].mean(axis=0), [2.0, 0.1, 0.0], atol=1e-12)
    np.testing.assert_allclose(np.linalg.norm(end[12:] - [2.0, 0.1, 0.0], axis=1), 0.1)
    assert not colliders(still).moves


def test_mesh_file(tmp_path: Path) -> None:
    trimesh.creation.box((1.0, 2.0, 3.0)).export(tmp_path / "box.obj")
    box = mesh({"shape": "mesh", "file": str(tmp_path / "box.obj"), "scale": 0.1, "position": [0, 1, 0]})
    np.testing.assert_allclose(box.bounds, [[-0.05, 0.9, -0.15], [0.05, 1.1, 0.15]], atol=1e-9)


@pytest.mark.parametrize(
    ("name", "content", "says"),
    [
        ("none.obj", None, "does not exist"),
        ("empty.obj", "v 0 0 0\n", "give"),
        ("broken.ply", "ply\nformat ascii 1.0\nelement vertex 9\n", "not readable"),
        ("nan.obj", "v 0 0 nan\nv 1 0 0\nv 0 1 0\nf 1 2 3\n", "finite"),
    ],
)
def test_mesh_files_that_cannot_be(tmp_path: Path, name: str, content: str | None, says: str) -> None:
    path = tmp_path / name
    if content is not None:
        path.write_text(content, encoding="ascii")
    with pytest.raises(InputError, match=says) as error:
        colliders({"shape": "mesh", "file": str(path)})
    assert name in str(error.value)
