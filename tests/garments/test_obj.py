"""OBJ: exact round trips, files of other programs, and one clear error for each way a file can be wrong."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import trimesh

from muslin.garments.errors import InputError
from muslin.garments.mesh import GarmentMesh
from muslin.garments.obj import read_garment, write_garment
from muslin.garments.template import template

MESH = template("tee", {"sleeve_length": 0.3}, 403)
POSITIONS = np.random.default_rng(0).normal(size=(MESH.num_vertices, 3))


def assert_same(a: GarmentMesh, b: GarmentMesh, order: np.ndarray) -> None:
    for key in ("panel_vertices", "panel_to_vertex", "uv"):
        np.testing.assert_array_equal(getattr(a, key), getattr(b, key))
    for key in ("faces", "panel_faces", "face_panel"):
        np.testing.assert_array_equal(getattr(a, key), getattr(b, key)[order])
    assert (a.name, a.parameters, a.panel_names) == (b.name, b.parameters, b.panel_names)


@pytest.mark.parametrize("sewn", [True, False])
def test_round_trip_is_exact(sewn: bool, tmp_path: Path) -> None:
    write_garment(MESH, tmp_path / "tee.obj", POSITIONS if sewn else None)
    mesh, positions = read_garment(tmp_path / "tee.obj")
    # Faces are grouped by panel, which they are in a template already.
    assert_same(mesh, MESH, np.argsort(MESH.face_panel, kind="stable"))
    if sewn:
        np.testing.assert_array_equal(positions, POSITIONS)
    else:
        assert positions is None


def test_other_programs_read_the_flat_file_with_its_area(tmp_path: Path) -> None:
    write_garment(MESH, tmp_path / "flat.obj")
    other = trimesh.load(tmp_path / "flat.obj", force="mesh", process=False)
    assert other.area == pytest.approx(MESH.face_areas.sum(), rel=1e-6)
    np.testing.assert_allclose(
        other.face_normals, np.broadcast_to([0.0, 0.0, 1.0], other.face_normals.shape), atol=1e-9
    )


TRIANGLE = "v 0 0 0\nv 2 0 0\nv 0 2 0\nvt 0 0\nvt 1 0\nvt 0 1\n"


def test_file_of_another_program_gets_panel_space_from_uv(tmp_path: Path) -> None:
    file = tmp_path / "quad.obj"
    file.write_text(
        "# other program\nmtllib x.mtl\nv 0 0 0\nv 2 0 0\nv 2 2 0\nv 0 2 0\n"
        "vt 0 0\nvt 0.5 0\nvt 0.5 0.5\nvt 0 0.5\nvn 0 0 1\ng front\nf 1/1/1 2/2/1 3/3/1 4/4/1\n"
    )
    mesh, positions = read_garment(file)
    assert positions is not None
    assert len(mesh.faces) == 2
    assert mesh.panel_names == ("front",)
    # Area 4 m^2 on a uv area of 1/4: 4 metres an uv unit.
    np.testing.assert_allclose(mesh.panel_vertices, 4.0 * mesh.uv)
    np.testing.assert_allclose(read_garment(file, uv_size=3.0)[0].panel_vertices, 3.0 * mesh.uv)
    with pytest.raises(InputError, match="uv_size = -1"):
        read_garment(file, uv_size=-1.0)
    file.write_text(TRIANGLE + "f -3/-3 -2/-2 -1/-1\n")
    np.testing.assert_array_equal(read_garment(file)[0].faces, [[0, 1, 2]])


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "is empty: 0 vertices, 0 faces"),
        (TRIANGLE, "is empty: 3 vertices, 0 faces"),
        (TRIANGLE + "f 1 2 3\n", "faces have no uv"),
        (TRIANGLE + "f 1/1 2/2 4/3\n", "names vertex 4; allowed: 1 to 3"),
        (TRIANGLE + "f 1/1 2/2 3/9\n", "names uv 9; allowed: 1 to 3"),
        (TRIANGLE + "f 1/1 2/2 0/3\n", "line 7: 'f 1/1 2/2 0/3' cannot be read: index 0"),
        (TRIANGLE + "f 1/1 2/2\n", "line 7.*at least 3 corners"),
        (TRIANGLE + "f 1/1 3/3 2/2\n", "inverted or empty"),
        (TRIANGLE + "f 1/1 2/2 3/3\nf 1/1 2/2 3/3\n", "not manifold"),
        (TRIANGLE.replace("v 2 0 0", "v nan 0 0") + "f 1/1 2/2 3/3\n", "vertex 2 is NaN or infinite"),
        (TRIANGLE.replace("vt 1 0", "vt inf 0") + "f 1/1 2/2 3/3\n", "must be positive|uv_size"),
        (TRIANGLE.replace("vt 1 0", "vt 2 0") + "f 1/1 2/2 3/3\n", "uv ranges over 0 to 2; allowed: 0 to 1"),
        (TRIANGLE.replace("v 2 0 0", "v 2 zero 0"), "line 2: 'v 2 zero 0' cannot be read"),
        ("v 1 2\n", "line 1: 'v 1 2' cannot be read: too few numbers"),
        (TRIANGLE + "# muslin panel_vertex 0 0 0\nf 1/1 2/2 3/3\n", "the file is damaged"),
        (TRIANGLE + "# muslin garment tee {\n", "cannot be read"),
        (TRIANGLE + "# muslin garment tee [1]\n", "cannot be read"),
        (TRIANGLE + "f 1/1 2/2 99999999999/3\n", "line 7.*index 99999999999; the largest is"),
    ],
)  # fmt: skip
def test_wrong_files_are_refused(text: str, message: str, tmp_path: Path) -> None:
    file = tmp_path / "wrong.obj"
    file.write_text(text)
    with pytest.raises(InputError, match=message) as caught:
        read_garment(file)
    assert str(caught.value).startswith(str(file))


def test_missing_and_binary_files_are_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="cannot be read: No such file"):
        read_garment(tmp_path / "none.obj")
    (tmp_path / "b.obj").write_bytes(b"\xff\xfe\x00\x80")
    with pytest.raises(InputError, match="not a text file"):
        read_garment(tmp_path / "b.obj")


def test_wrong_positions_do_not_destroy_the_file(tmp_path: Path) -> None:
    file = tmp_path / "tee.obj"
    write_garment(MESH, file)
    before = file.read_bytes()
    for wrong in (POSITIONS[:-1], np.full_like(POSITIONS, np.nan)):
        with pytest.raises(InputError, match="must be finite and"):
            write_garment(MESH, file, wrong)
    assert file.read_bytes() == before
    assert list(tmp_path.iterdir()) == [file]
