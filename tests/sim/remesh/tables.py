"""Checks of corner tables against what they say of themselves, half-edge by half-edge."""

from __future__ import annotations

import numpy as np

from muslin.sim.remesh.panel_mesh import DEAD, FREE, PanelMesh
from muslin.sim.remesh.sewn_mesh import SewnMesh


def check_table(mesh: PanelMesh, sewn: bool = False) -> None:
    """Twins, rims, leaving half-edges, fans, what is spare, and the sign of every triangle; where `sewn`,
    boundaries may have twins of the third kind, whatever these say."""
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
    assert sewn or (twin[free] == int(FREE)).all()
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


def check_sewn(mesh: SewnMesh) -> None:
    """The panels' tables, seams, the copies of every sewn vertex, what is spare, and the vertices' areas."""
    panels = mesh.panels
    check_table(panels, sewn=True)
    faces = int(panels.size.numpy()[1])
    corner, twin = panels.corner.numpy()[: 3 * faces], panels.twin.numpy()[: 3 * faces]
    half = np.flatnonzero(corner != int(DEAD))
    after = np.where(np.arange(3 * faces) % 3 == 2, np.arange(3 * faces) - 2, np.arange(3 * faces) + 1)
    # Both sides of a seam run between the same sewn vertices, one each way.
    vertex = mesh.vertex.numpy()
    side = half[twin[half] <= -2]
    mate = -2 - twin[side]
    assert (corner[mate] != int(DEAD)).all()
    np.testing.assert_array_equal(-2 - twin[mate], side)
    np.testing.assert_array_equal(vertex[corner[side]], vertex[corner[after[mate]]])
    np.testing.assert_array_equal(vertex[corner[after[side]]], vertex[corner[mate]])
    # The ring of each sewn vertex is the panel vertices that name it.
    copy, next_copy = mesh.copy.numpy(), mesh.next_copy.numpy()
    used = np.unique(corner[half])
    sewn = np.flatnonzero(copy >= 0)
    ringed = []
    for v in sewn:
        p = int(copy[v])
        while True:
            assert vertex[p] == v
            ringed.append(p)
            p = int(next_copy[p])
            if p == copy[v]:
                break
            assert len(ringed) <= len(used)
    np.testing.assert_array_equal(np.sort(ringed), used)
    count, spares = mesh.size.numpy().tolist()
    spare = mesh.spare.numpy()[:spares]
    assert len(set(spare)) == spares
    assert not set(spare) & set(sewn)
    assert len(sewn) + spares == count
    # A third of each face's area at its corners.
    triangles = corner.reshape(-1, 3)[corner[::3] != int(DEAD)]
    a, b, c = panels.point.numpy()[triangles].swapaxes(0, 1)
    third = ((b - a)[:, 0] * (c - a)[:, 1] - (b - a)[:, 1] * (c - a)[:, 0]) / 6.0
    area = np.bincount(vertex[triangles].ravel(), np.repeat(third, 3), minlength=len(copy))
    np.testing.assert_allclose(mesh.area.numpy()[sewn], area[sewn], rtol=1e-11, atol=1e-13 * area.sum())
