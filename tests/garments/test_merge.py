"""Several garments as one mesh: everything that a garment holds is still there, and says whose it is."""

from __future__ import annotations

import numpy as np
import pytest

from muslin.garments import catalogue
from muslin.garments.merge import face_owner, merge_meshes
from muslin.garments.mesh import GarmentMesh
from muslin.garments.triangulate import triangulate


@pytest.fixture(scope="module")
def garments() -> list[GarmentMesh]:
    tee, sheet = catalogue.get("tee"), catalogue.get("sheet")
    return [
        triangulate(tee.pattern(**tee.preset("top")), 0.1),
        triangulate(sheet.pattern(width=0.3, length=0.4), 0.1),
        triangulate(tee.pattern(**tee.preset("tshirt")), 0.1),
    ]


def test_the_parts_of_a_merged_mesh_are_the_garments(garments: list[GarmentMesh]) -> None:
    merged = merge_meshes(["top", "sheet", "tshirt"], garments)
    merged.validate()
    assert merged.num_vertices == sum(mesh.num_vertices for mesh in garments)
    assert merged.panel_names[:1] == ("top.front",)
    assert "sheet.sheet" in merged.panel_names
    owner = face_owner(merged)
    first_vertex = first_corner = 0
    for k, mesh in enumerate(garments):
        np.testing.assert_array_equal(merged.faces[owner == k], mesh.faces + first_vertex)
        np.testing.assert_array_equal(merged.panel_faces[owner == k], mesh.panel_faces + first_corner)
        first_vertex += mesh.num_vertices
        first_corner += len(mesh.panel_vertices)
    np.testing.assert_allclose(merged.face_areas, np.concatenate([mesh.face_areas for mesh in garments]))
    assert len(merged.boundary_loops) == sum(len(mesh.boundary_loops) for mesh in garments)
    assert merged.parameters["sheet.width"] == 0.3
    assert merged.name == "top+sheet+tshirt"


def test_uv_is_tiled_without_distortion_or_overlap(garments: list[GarmentMesh]) -> None:
    merged = merge_meshes(["top", "sheet", "tshirt"], garments)
    corners = np.cumsum([0, *(len(mesh.panel_vertices) for mesh in garments)])
    boxes = []
    for k, mesh in enumerate(garments):
        uv = merged.uv[corners[k] : corners[k + 1]]
        np.testing.assert_allclose(2.0 * (uv - uv[0]), mesh.uv - mesh.uv[0], atol=1e-12)
        boxes.append(np.floor(2.0 * uv.mean(axis=0)).tolist())
        assert (2.0 * uv >= np.array(boxes[-1]) - 1e-12).all()
        assert (2.0 * uv <= np.array(boxes[-1]) + 1.0 + 1e-12).all()
    assert len({tuple(box) for box in boxes}) == 3


def test_one_garment_stays_as_it_is(garments: list[GarmentMesh]) -> None:
    assert merge_meshes(["top"], garments[:1]) is garments[0]
    assert not face_owner(garments[0]).any()
