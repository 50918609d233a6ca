"""A garment that changes: its panels as corner tables, sewn together, and the state of its vertices."""

from dataclasses import dataclass

import numpy as np
import warp as wp
from numpy.typing import NDArray

from muslin.garments.half_edges import opposite
from muslin.garments.mesh import GarmentMesh
from muslin.sim.remesh.panel_mesh import FREE, PanelMesh, apex, around, empty_mesh, head

wp.set_module_options({"enable_backward": False})


PINNED = wp.constant(2)  # of `locked`: the edge between two such vertices is not split either


@wp.struct
class SewnMesh:
    """Panels sewn together. A sewn vertex on a seam has a copy in each panel, or several in one.

    panels      corner tables of the panels; twins <= -2 name the half-edge on the other side of a seam
    uv          (P,) canonical layout
    vertex      (P,) sewn vertex of each panel vertex
    next_copy   (P,) the next panel vertex of the same sewn vertex, itself where there is but one: a ring
    home        (P,) a face of the mesh before any change that the panel vertex lies in or near
    x, v, held  (V,) position, metres; velocity, m/s; what friction holds, metres
    area        (V,) area of the vertex in panel space, m^2: a third of each face's; its mass over the density
    drift       (V,) metres from the surface as it was loaded within which the faces around the vertex lie
    locked      (V,) 0, or 1 where the vertex has to stay, or PINNED
    copy        (V,) one panel vertex of each sewn vertex, -1 where it is no more
    size        (2,) sewn vertices ever used, and those of them that are spare
    spare       (V,) stack of sewn vertices that will be used again
    origin      (V,) number of the vertex in the garment that was loaded, -1 of a new one
    clock       (1,) changes so far; changed (V,) the last of them that concerned each vertex
    refused     (3 F, 2) changes made when the flip and the collapse of an edge were last refused: as long as
                nothing around it changes, they would be again
    """

    panels: PanelMesh
    uv: wp.array(dtype=wp.vec2d)
    vertex: wp.array(dtype=wp.int32)
    next_copy: wp.array(dtype=wp.int32)
    home: wp.array(dtype=wp.int32)
    x: wp.array(dtype=wp.vec3d)
    v: wp.array(dtype=wp.vec3d)
    held: wp.array(dtype=wp.vec3d)
    area: wp.array(dtype=wp.float64)
    drift: wp.array(dtype=wp.float64)
    locked: wp.array(dtype=wp.int32)
    copy: wp.array(dtype=wp.int32)
    size: wp.array(dtype=wp.int32)
    spare: wp.array(dtype=wp.int32)
    origin: wp.array(dtype=wp.int32)
    clock: wp.array(dtype=wp.int32)
    changed: wp.array(dtype=wp.int32)
    refused: wp.array2d(dtype=wp.int32)


@dataclass(frozen=True, eq=False)
class GarmentState:
    """A garment mesh and what its V vertices do.

    positions, velocities, held: (V, 3), metres, m/s, metres (what friction holds)
    locked: (V,) int32, 1 for vertices that must stay, PINNED for those that are led
    """

    mesh: GarmentMesh
    positions: NDArray[np.float64]
    velocities: NDArray[np.float64]
    held: NDArray[np.float64]
    locked: NDArray[np.int32]


def load(state: GarmentState, metric: NDArray[np.float64], room: int) -> SewnMesh:
    """Tables of a garment with the sizing field (P, 2, 2), and room for so many panel vertices."""
    garment = state.mesh
    size_p, size_v, size_f = len(garment.panel_vertices), garment.num_vertices, len(garment.faces)
    mesh = SewnMesh()
    panels = empty_mesh(room)
    mesh.panels = panels
    panels.point.numpy()[:size_p] = garment.panel_vertices
    panels.metric.numpy()[:size_p] = metric
    panels.corner.numpy()[: 3 * size_f] = garment.panel_faces.ravel()
    panels.panel.numpy()[:size_f] = garment.face_panel
    panels.size.numpy()[:2] = size_p, size_f
    twin = _twins(garment)
    panels.twin.numpy()[: 3 * size_f] = twin
    tail = garment.panel_faces.ravel()
    leaving = panels.leaving.numpy()
    leaving[tail] = np.arange(3 * size_f)
    rim = np.flatnonzero(twin < 0)
    leaving[tail[rim]] = rim
    panels.on_rim.numpy()[tail[rim]] = 1
    per_panel_vertex = {"uv": wp.vec2d, "vertex": wp.int32, "next_copy": wp.int32, "home": wp.int32}
    per_vertex = {"x": wp.vec3d, "v": wp.vec3d, "held": wp.vec3d, "area": wp.float64}
    per_vertex |= {"locked": wp.int32, "copy": wp.int32, "spare": wp.int32, "origin": wp.int32}
    per_vertex |= {"changed": wp.int32, "drift": wp.float64}
    for name, dtype in {**per_panel_vertex, **per_vertex}.items():
        setattr(mesh, name, wp.zeros(room, dtype=dtype, device="cpu"))
    mesh.size = wp.array([size_v, 0], dtype=wp.int32, device="cpu")
    mesh.clock = wp.zeros(1, dtype=wp.int32, device="cpu")
    mesh.refused = wp.full((len(panels.corner), 2), -1, dtype=wp.int32, device="cpu")
    mesh.uv.numpy()[:size_p] = garment.uv
    mesh.vertex.numpy()[:size_p] = garment.panel_to_vertex
    mesh.next_copy.numpy()[:size_p] = _next_copies(garment.panel_to_vertex)
    mesh.home.numpy()[garment.panel_faces] = np.arange(size_f)[:, None]
    mesh.x.numpy()[:size_v] = state.positions
    mesh.v.numpy()[:size_v] = state.velocities
    mesh.held.numpy()[:size_v] = state.held
    mesh.area.numpy()[:size_v] = garment.vertex_areas
    mesh.locked.numpy()[:size_v] = state.locked
    mesh.origin.numpy()[:size_v] = np.arange(size_v)
    mesh.copy.numpy()[:] = -1
    mesh.copy.numpy()[garment.panel_to_vertex] = np.arange(size_p)
    return mesh


def unload(mesh: SewnMesh, source: GarmentState) -> tuple[GarmentState, NDArray[np.int32]]:
    """The garment as it is now, and the number (V',) that each of its vertices had in `source`, or -1."""
    panels = mesh.panels
    count = panels.size.numpy()[1]
    corners = panels.corner.numpy()[: 3 * count].reshape(-1, 3)
    alive = corners[:, 0] >= 0
    faces, panel = corners[alive], panels.panel.numpy()[:count][alive]
    used = np.flatnonzero(panels.leaving.numpy() >= 0)
    number = np.zeros(len(panels.leaving), dtype=np.int32)
    number[used] = np.arange(len(used))
    sewn = np.flatnonzero(mesh.copy.numpy() >= 0)
    sewn_number = np.zeros(len(mesh.copy), dtype=np.int32)
    sewn_number[sewn] = np.arange(len(sewn))
    panel_to_vertex = sewn_number[mesh.vertex.numpy()[used]]
    panel_faces = number[faces]
    garment = GarmentMesh(
        faces=panel_to_vertex[panel_faces],
        panel_faces=panel_faces,
        panel_vertices=panels.point.numpy()[used].copy(),
        panel_to_vertex=panel_to_vertex,
        face_panel=panel.copy(),
        panel_names=source.mesh.panel_names,
        uv=mesh.uv.numpy()[used].copy(),
        name=source.mesh.name,
        parameters=dict(source.mesh.parameters),
    )
    rows = (array.numpy()[sewn].copy() for array in (mesh.x, mesh.v, mesh.held, mesh.locked))
    return GarmentState(garment, *rows), mesh.origin.numpy()[sewn].copy()


def _twins(garment: GarmentMesh) -> NDArray[np.int64]:
    """(3 F,) twins as `panel_mesh` says, by panel vertices first and by sewn ones where those find none."""
    faces = garment.panel_faces.astype(np.int64)
    tail, tip = faces.ravel(), np.roll(faces, -1, axis=1).ravel()
    twin = opposite(tail, tip, len(garment.panel_vertices))
    rim = np.flatnonzero(twin < 0)
    vertex = garment.panel_to_vertex
    mate = opposite(vertex[tail[rim]], vertex[tip[rim]], garment.num_vertices)
    twin[rim] = np.where(mate >= 0, -2 - rim[mate], int(FREE))
    return twin


def _next_copies(panel_to_vertex: NDArray[np.int32]) -> NDArray[np.int64]:
    """(P,) rings over the panel vertices of each sewn vertex."""
    order = np.argsort(panel_to_vertex, kind="stable")
    sorted_ = panel_to_vertex[order]
    first = np.r_[True, sorted_[1:] != sorted_[:-1]]
    start = np.flatnonzero(first)
    following = np.arange(1, len(order) + 1)
    following[np.r_[start[1:] - 1, len(order) - 1]] = start
    ring = np.empty(len(order), dtype=np.int64)
    ring[order] = order[following]
    return ring


@wp.func
def new_sewn_vertex(mesh: SewnMesh) -> int:
    """A sewn vertex that is not in use; there is room for one a panel vertex."""
    if mesh.size[1] > 0:
        mesh.size[1] -= 1
        return mesh.spare[mesh.size[1]]
    v = mesh.size[0]
    mesh.size[0] = v + 1
    return v


@wp.func
def drop_sewn_vertex(mesh: SewnMesh, v: int):
    """Takes a sewn vertex without copies out of use."""
    mesh.copy[v] = -1
    mesh.spare[mesh.size[1]] = v
    mesh.size[1] += 1


@wp.func
def add_copy(mesh: SewnMesh, v: int, p: int):
    """Makes the panel vertex p the first or a further copy of the sewn vertex v."""
    mesh.vertex[p] = v
    q = mesh.copy[v]
    if q < 0:
        mesh.copy[v] = p
        mesh.next_copy[p] = p
    else:
        mesh.next_copy[p] = mesh.next_copy[q]
        mesh.next_copy[q] = p


@wp.func
def are_joined(mesh: SewnMesh, v: int, w: int) -> bool:
    """Whether an edge of any panel joins two sewn vertices."""
    p = mesh.copy[v]
    while True:
        first = mesh.panels.leaving[p]
        h = first
        while True:
            if mesh.vertex[head(mesh.panels, h)] == w or mesh.vertex[apex(mesh.panels, h)] == w:
                return True
            h = around(mesh.panels, h)
            if h < 0 or h == first:
                break
        p = mesh.next_copy[p]
        if p == mesh.copy[v]:
            return False
    return False


@wp.func
def touch(mesh: SewnMesh, v: int):
    """Notes that a change concerns the sewn vertex v."""
    mesh.changed[v] = mesh.clock[0]


@wp.func
def was_refused(mesh: SewnMesh, h: int, kind: int, v: int, w: int) -> bool:
    """Whether a change of h was refused, and nothing that concerns v or w was changed since."""
    when = mesh.refused[h, kind]
    return when >= mesh.changed[v] and when >= mesh.changed[w]
