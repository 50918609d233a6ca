"""The corner table stays one of a manifold through every pass of a triangulation."""

from __future__ import annotations

import numpy as np
import pytest
import warp as wp

from muslin.garments.designs.tee import TEE
from muslin.garments.mesh import GarmentMesh
from muslin.garments.template import template
from muslin.sim.remesh import fill
from muslin.sim.remesh.panel_mesh import PanelMesh
from muslin.sim.remesh.topology import remesh
from tests.sim.remesh.panels import annulus, disk, tube
from tests.sim.remesh.tables import check_table

PASSES = ("split", "collapse", "relax", "mend")


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
