"""The corner table stays one of a manifold through every pass of a triangulation."""

from __future__ import annotations

import numpy as np
import pytest
import warp as wp

from muslin.garments.designs.tee import TEE
from muslin.garments.mesh import GarmentMesh
from muslin.garments.template import template
from muslin.sim.remesh import fill
from muslin.sim.remesh.panel_mesh import DEAD, FREE, PanelMesh
from muslin.sim.remesh.topology import remesh
from tests.sim.remesh.panels import annulus, disk, tube

PASSES = ("split", "collapse", "relax", "mend")


def check_table(mesh: PanelMesh) -> None:
    """Twins, rims, leaving half-edges, fans, what is spare, and the sign of every triangle."""
    vertices, faces, spare_vertices, spare_faces = mesh.size.numpy().tolist()
    corner, twin = mesh.corner.numpy()[: 3 * faces], mesh.twin.numpy()[: 3 * faces]
    half = np.flatnonzero(corner != int(DEAD))
    assert (corner.reshape(-1, 3) == int(DEAD)).any(axis=1).sum() == spare_faces
    after = np.where(np.arange(3 * faces) % 3 == 2, np.arange(3 * faces) - 2, np.arange(3 * faces) + 1)
    before = after[after]
    # Every half-edge has a twin that runs the other way in the same panel, or lies on the rim.
    joined = half[twin[half] >= 0]
    other = twin[joined]
    assert (corner[other] != int(DEAD)).all()
    np.testing.assert_array_equal(twin[other], joined)
    np.testing.assert_array_equal(corner[other], corner[after[joined]])
    np.testing.assert_array_equal(corner[after[other]], corner[joined])
    panel = mesh.panel.numpy()
    np.testing.assert_array_equal(panel[other // 3], panel[joined // 3])
    free = half[twin[half] < 0]
    assert (twin[free] == int(FREE)).all()
    on_rim = np.zeros(len(mesh.point), dtype=bool)
    on_rim[corner[free]] = True
    used = np.unique(corner[half])
    np.testing.assert_array_equal(mesh.on_rim.numpy()[used] == 1, on_rim[used])
    assert len(np.unique(corner[free])) == len(free), "a rim vertex is left by one half-edge"
    # Round each vertex, from the half-edge that leaves it, every corner comes by once.
    leaving = mesh.leaving.numpy()
    corners_at = np.bincount(corner[half], minlength=len(mesh.point))
    for v in used:
        h, seen = int(leaving[v]), 0
        assert corner[h] == v
        assert not on_rim[v] or twin[h] < 0
        while True:
            seen += 1
            h = int(twin[before[h]])
            if h < 0 or h == leaving[v]:
                break
        assert seen == corners_at[v]
        assert on_rim[v] == (h < 0)
    # What is not used is spare, once.
    spare = mesh.spare_vertex.numpy()[:spare_vertices]
    assert len(set(spare)) == spare_vertices
    assert not set(spare) & set(used)
    assert len(used) + spare_vertices == vertices
    a, b, c = mesh.point.numpy()[corner.reshape(-1, 3)[corner[::3] != int(DEAD)]].swapaxes(0, 1)
    u, v = b - a, c - a
    assert (u[:, 0] * v[:, 1] - u[:, 1] * v[:, 0] > 0.0).all()


def case(name: str) -> GarmentMesh:
    if name in ("top", "long_dress"):
        return template("tee", TEE.preset(name), 1400)
    return {"annulus": annulus(0.1, 0.3, 40, 6), "disk": disk(0.2, 30, 5), "tube": tube(0.6, 0.4, 20, 12)}[
        name
    ]


@pytest.mark.parametrize("name", ["top", "long_dress", "annulus", "disk", "tube"])
def test_every_pass_leaves_a_manifold(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    checked: dict[str, int] = dict.fromkeys(PASSES, 0)

    def checking(name: str):
        original = getattr(fill._Table, name)

        def run(table: fill._Table, *arguments: float):
            if not any(checked.values()):
                check_table(table.mesh)  # as ears and bridges left it
            result = original(table, *arguments)
            checked[name] += 1
            check_table(table.mesh)
            return result

        return run

    for one in PASSES:
        monkeypatch.setattr(fill._Table, one, checking(one))
    mesh = case(name)
    remesh(mesh, np.zeros((mesh.num_vertices, 3)), mesh.face_areas.sum() / 800, seed=1)
    assert all(checked.values())


def test_the_checker_finds_what_is_wrong() -> None:
    caught = {}

    def keep(mesh: PanelMesh, rim: int) -> fill.Filling:
        caught["mesh"] = mesh
        return compact(mesh, rim)

    compact = fill._compacted
    mesh = disk(0.2, 30, 5)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(fill, "_compacted", keep)
        remesh(mesh, np.zeros((mesh.num_vertices, 3)), mesh.face_areas.sum() / 200)
    table = caught["mesh"]
    check_table(table)
    for name in ("twin", "leaving", "on_rim"):
        array: wp.array = getattr(table, name)
        place = int(np.argmax(table.on_rim.numpy() == 0)) if name != "twin" else 0
        kept = int(array.numpy()[place])
        array.numpy()[place] = kept + 1
        with pytest.raises(AssertionError):
            check_table(table)
        array.numpy()[place] = kept
    check_table(table)
