"""Triangulations of panels as corner tables that can change in place.

Half-edge h = 3 f + k runs from corner k of face f to the next; `twin[h]` is the half-edge on the other side:

    twin >= 0    that half-edge, in the same panel
    FREE         none: a hem, a cuff, a neckline
    <= -2        half-edge -2 - twin of another piece of boundary that is sewn to this one

All panels lie in one table, each in its own plane, and share no panel vertex. (A corner table: J. Rossignac,
A. Safonova, A. Szymczak 2001, "3D compression made simple: Edgebreaker on a corner-table".)
"""

import numpy as np
import warp as wp
from numpy.typing import NDArray

wp.set_module_options({"enable_backward": False})

FREE = wp.constant(-1)
DEAD = wp.constant(-1)  # corner of a face that is no more


@wp.struct
class PanelMesh:
    """Panels that change; arrays are longer than what is in use.

    point      (P,) panel space, metres
    metric     (P,) sizing tensor, 1/m^2: an edge u is as long as it should be where u . M u = 1
    on_rim     (P,) 1 where the vertex lies on the boundary of its panel
    leaving    (P,) a half-edge that leaves the vertex; on the boundary the one that has no twin in its panel
    corner     (3 F,) vertex of each corner; DEAD where the face is no more
    twin       (3 F,) see the head of the module
    panel      (F,) panel of each face
    size       (4,) vertices and faces ever used, and those of them that are spare now
    spare_vertex, spare_face   stacks of what was removed and will be used again
    """

    point: wp.array(dtype=wp.vec2d)
    metric: wp.array(dtype=wp.mat22d)
    on_rim: wp.array(dtype=wp.int32)
    leaving: wp.array(dtype=wp.int32)
    corner: wp.array(dtype=wp.int32)
    twin: wp.array(dtype=wp.int32)
    panel: wp.array(dtype=wp.int32)
    size: wp.array(dtype=wp.int32)
    spare_vertex: wp.array(dtype=wp.int32)
    spare_face: wp.array(dtype=wp.int32)


def empty_mesh(vertices: int) -> PanelMesh:
    """A table with room for so many vertices, and for the faces between them, none in use."""
    mesh = PanelMesh()
    faces = 2 * vertices
    mesh.point = wp.zeros(vertices, dtype=wp.vec2d, device="cpu")
    mesh.metric = wp.zeros(vertices, dtype=wp.mat22d, device="cpu")
    mesh.on_rim = wp.zeros(vertices, dtype=wp.int32, device="cpu")
    mesh.leaving = wp.full(vertices, -1, dtype=wp.int32, device="cpu")
    mesh.corner = wp.full(3 * faces, DEAD, dtype=wp.int32, device="cpu")
    mesh.twin = wp.full(3 * faces, FREE, dtype=wp.int32, device="cpu")
    mesh.panel = wp.zeros(faces, dtype=wp.int32, device="cpu")
    mesh.size = wp.zeros(4, dtype=wp.int32, device="cpu")
    mesh.spare_vertex = wp.zeros(vertices, dtype=wp.int32, device="cpu")
    mesh.spare_face = wp.zeros(faces, dtype=wp.int32, device="cpu")
    return mesh


def faces_of(mesh: PanelMesh) -> tuple[NDArray[np.int32], NDArray[np.int32]]:
    """(F, 3) faces that live, and (F,) the panel of each."""
    count = mesh.size.numpy()[1]
    corners = mesh.corner.numpy()[: 3 * count].reshape(-1, 3)
    alive = corners[:, 0] != int(DEAD)
    return corners[alive], mesh.panel.numpy()[:count][alive]


@wp.func
def new_vertex(mesh: PanelMesh) -> int:
    """A vertex that is not in use, or -1 where there is no room."""
    if mesh.size[2] > 0:
        mesh.size[2] -= 1
        return mesh.spare_vertex[mesh.size[2]]
    v = mesh.size[0]
    if v >= mesh.point.shape[0]:
        return -1
    mesh.size[0] = v + 1
    return v


@wp.func
def new_face(mesh: PanelMesh) -> int:
    """A face that is not in use; there are always as many as two for every vertex."""
    if mesh.size[3] > 0:
        mesh.size[3] -= 1
        return mesh.spare_face[mesh.size[3]]
    f = mesh.size[1]
    mesh.size[1] = f + 1
    return f


@wp.func
def drop_vertex(mesh: PanelMesh, v: int):
    """Takes a vertex that no face has any more out of use."""
    mesh.leaving[v] = -1
    mesh.spare_vertex[mesh.size[2]] = v
    mesh.size[2] += 1


@wp.func
def drop_face(mesh: PanelMesh, f: int):
    """Takes a face out of use."""
    for k in range(3):
        mesh.corner[3 * f + k] = DEAD
        mesh.twin[3 * f + k] = FREE
    mesh.spare_face[mesh.size[3]] = f
    mesh.size[3] += 1


@wp.func
def following(h: int) -> int:
    """The next half-edge of the same face."""
    if h % 3 == 2:
        return h - 2
    return h + 1


@wp.func
def preceding(h: int) -> int:
    """The half-edge before h in the same face."""
    if h % 3 == 0:
        return h + 2
    return h - 1


@wp.func
def head(mesh: PanelMesh, h: int) -> int:
    """Vertex at which h ends."""
    return mesh.corner[following(h)]


@wp.func
def apex(mesh: PanelMesh, h: int) -> int:
    """Vertex opposite h in its face."""
    return mesh.corner[preceding(h)]


@wp.func
def around(mesh: PanelMesh, h: int) -> int:
    """The half-edge that leaves the same vertex as h, next counter-clockwise; negative past the last face."""
    return mesh.twin[preceding(h)]


@wp.func
def link(mesh: PanelMesh, h: int, other: int):
    """Makes `other` the twin of h, and h that of other, whichever of the three kinds it is."""
    mesh.twin[h] = other
    if other >= 0:
        mesh.twin[other] = h
    elif other <= -2:
        mesh.twin[-2 - other] = -2 - h


@wp.func
def settle_leaving(mesh: PanelMesh, h: int):
    """Makes h the half-edge by which its vertex is left, unless the vertex has one on the boundary and h is
    not it."""
    v = mesh.corner[h]
    if mesh.on_rim[v] == 0 or mesh.twin[h] < 0:
        mesh.leaving[v] = h
