"""Remeshing between time steps: what is pinned stays so, every garment keeps its fabric, runs repeat."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from muslin.garments.merge import face_owner, merge_meshes
from muslin.garments.mesh import GarmentMesh
from muslin.sim.cloth import build_cloth
from muslin.sim.contact.system import ContactSettings
from muslin.sim.dataset.intersections import count_intersections
from muslin.sim.material import load_fabric
from muslin.sim.remesh.in_loop import Remesher
from muslin.sim.remesh.settings import RemeshSettings
from muslin.sim.solve.settings import SolverSettings
from muslin.sim.solve.simulator import ClothSimulator
from tests.sim.meshes import sheet
from tests.sim.remesh.draped import NOBODY, at_vertices

Array = NDArray[np.float64]

FABRICS = tuple(load_fabric(name) for name in ("gray-interlock", "11oz-black-denim"))
SETTINGS = RemeshSettings(
    refine_angle=0.3, refine_compression=0.005, refine_velocity=0.5, size_min=0.01, size_max=0.08, every=1
)
DT, LED = 1.0 / 60.0, 0.01


def level(mesh: GarmentMesh, height: float) -> Array:
    return at_vertices(
        mesh, lambda p: np.stack([p[:, 0], np.full(len(p), height) + 0.01 * p[:, 1], -p[:, 1]], 1)
    )


def sheets(count: int) -> GarmentMesh:
    """Sheets of half a metre by a third."""
    one = sheet("irregular", 0.5, 0.3, 0.05)
    return merge_meshes([f"sheet{k}" for k in range(count)], [one] * count) if count > 1 else one


def hung(count: int = 1) -> tuple[ClothSimulator, Remesher]:
    """Sheets one 5 cm above the other, held along their left and right sides."""
    mesh = sheets(count)
    owner = face_owner(mesh) if count > 1 else np.zeros(len(mesh.faces), np.int32)
    cloth = build_cloth(mesh, FABRICS[:count], owner)
    height = np.zeros(mesh.num_vertices)
    height[mesh.faces] = 0.05 * owner[:, None]
    positions = level(mesh, 0.0) + height[:, None] * [0.0, 1.0, 0.0]
    sim = ClothSimulator(cloth, positions, *NOBODY, ContactSettings(), SolverSettings(), "cpu")
    x = positions[:, 0]
    sim.pins = (x <= x.min() + 1e-9) | (x >= x.max() - 1e-9)
    return sim, Remesher(SETTINGS, mesh, FABRICS[:count])


def left_side_led(sim: ClothSimulator) -> Array:
    """(V, 3) where the vertices have to go: the left side comes nearer to the right one."""
    targets = sim.positions
    targets[sim.pins & (targets[:, 0] < 0.25), 0] += LED
    return targets


def momentum(sim: ClothSimulator) -> Array:
    return sim.cloth.mass @ sim.velocity


def test_a_sheet_that_hangs_by_two_sides_goes_on_hanging() -> None:
    sim, remesher = hung()
    began, edges = sim.positions[sim.pins], len(sim.cloth.edges)
    order = np.lexsort(began.T)
    mass = sim.cloth.mass.sum()
    counts = []
    for k in range(16):
        began[began[:, 0] < 0.25, 0] += LED
        sim.advance(None, DT, pin_targets=left_side_led(sim))
        before = momentum(sim)
        scale = np.abs(sim.cloth.mass[:, None] * sim.velocity).sum()
        origin = remesher.step(sim)
        held = sim.positions[sim.pins]
        np.testing.assert_allclose(held[np.lexsort(held.T)], began[order], atol=1e-12)
        np.testing.assert_allclose(momentum(sim), before, atol=1e-12 * scale)
        assert sim.cloth.mass.sum() == pytest.approx(mass, rel=1e-13)
        assert count_intersections(sim.positions, sim.cloth.faces, *NOBODY).cloth_cloth == 0
        assert origin is None or len(origin) == sim.cloth.num_vertices
        np.testing.assert_array_equal(remesher.mesh.faces, sim.cloth.faces)
        counts.append(len(sim.cloth.edges))
        assert k > 0 or counts[0] != edges
    assert remesher.changes.splits > 100
    assert remesher.changes.collapses > 10
    lowest = sim.positions[:, 1].min()
    assert lowest < -0.03, "it sags in between"


def test_garments_keep_their_fabrics() -> None:
    sim, remesher = hung(2)
    names = remesher.mesh.name
    weight = [
        fabric.density * remesher.mesh.face_areas[face_owner(remesher.mesh) == k].sum()
        for k, fabric in enumerate(FABRICS)
    ]
    for _ in range(8):
        sim.advance(None, DT, pin_targets=left_side_led(sim))
        remesher.step(sim)
        owner = face_owner(remesher.mesh)
        assert sim.cloth.fabrics == FABRICS
        np.testing.assert_array_equal(sim.cloth.face_fabric, owner)
        for k, fabric in enumerate(FABRICS):
            mine = sim.cloth.faces[owner == k]
            others = sim.cloth.faces[owner != k]
            assert not set(mine.ravel()) & set(others.ravel())
            mass = sim.cloth.mass[np.unique(mine)].sum()
            assert mass == pytest.approx(weight[k], rel=1e-13)
            assert mass == pytest.approx(fabric.density * sim.cloth.rest_area[owner == k].sum(), rel=1e-13)
    assert remesher.mesh.name == names
    assert remesher.changes.total > 100


def test_the_same_run_gives_the_same_bytes() -> None:
    ends = []
    for _ in range(2):
        sim, remesher = hung(2)
        for _ in range(4):
            sim.advance(None, DT, pin_targets=left_side_led(sim))
            remesher.step(sim)
        ends.append((sim.positions.tobytes(), sim.velocity.tobytes(), remesher.mesh.panel_faces.tobytes()))
    assert ends[0] == ends[1]


def test_only_every_so_many_steps() -> None:
    sim, remesher = hung()
    remesher.settings = RemeshSettings(size_min=0.01, size_max=0.02, every=3)
    sizes = []
    for _ in range(4):
        remesher.step(sim)
        sizes.append(sim.cloth.num_vertices)
    assert sizes[0] == sizes[1] < sizes[2] == sizes[3]
