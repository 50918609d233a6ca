"""Split of an edge of a garment in motion, in its middle: the surface, mass and momentum stay as they are.

With a third of each face's area at its corners, in units of the density, the linear momentum is
sum_f A_f/3 sum_k v_k; halves of a face with the mean velocity in the middle have what the face had.
"""

import warp as wp

from muslin.sim.remesh.operations import doubled_area, sew, split
from muslin.sim.remesh.panel_mesh import PanelMesh, apex, head, new_vertex
from muslin.sim.remesh.passes import squared_length
from muslin.sim.remesh.sewn_mesh import SewnMesh, add_copy, new_sewn_vertex, touch

wp.set_module_options({"enable_backward": False})


@wp.func
def size_squared(mesh: SewnMesh, h: int) -> wp.float64:
    """Squared size of the edge of h in the metric, on a seam that of the longer side."""
    panels = mesh.panels
    size = squared_length(panels, panels.corner[h], head(panels, h))
    t = panels.twin[h]
    if t <= -2:
        g = -2 - t
        size = wp.max(size, squared_length(panels, panels.corner[g], head(panels, g)))
    return size


@wp.func
def face_area(panels: PanelMesh, h: int) -> wp.float64:
    """Area in panel space of the face of h, m^2."""
    a = panels.point[panels.corner[h]]
    return wp.float64(0.5) * doubled_area(a, panels.point[head(panels, h)], panels.point[apex(panels, h)])


@wp.func
def put_middle(mesh: SewnMesh, h: int, m: int, p: int):
    """Makes p the copy of the sewn vertex m in the middle of h, before the edge is split there."""
    half = wp.float64(0.5)
    panels = mesh.panels
    a = panels.corner[h]
    b = head(panels, h)
    panels.point[p] = (panels.point[a] + panels.point[b]) * half
    panels.metric[p] = (panels.metric[a] + panels.metric[b]) * half
    mesh.uv[p] = (mesh.uv[a] + mesh.uv[b]) * half
    mesh.home[p] = mesh.home[a]
    add_copy(mesh, m, p)


@wp.func
def share_split(mesh: SewnMesh, h: int, m: int):
    """Gives the new vertex m its share of the face of h, which is about to be halved."""
    panels = mesh.panels
    sixth = face_area(panels, h) / wp.float64(6.0)
    mesh.area[mesh.vertex[panels.corner[h]]] -= sixth
    mesh.area[mesh.vertex[head(panels, h)]] -= sixth
    mesh.area[m] += sixth + sixth


@wp.func
def split_edge(mesh: SewnMesh, h: int) -> bool:
    """Splits an edge in its middle, on both sides of a seam; the surface stays. False where the table is
    full."""
    panels = mesh.panels
    half = wp.float64(0.5)
    t = panels.twin[h]
    g = int(-1)
    p = new_vertex(panels)
    if p < 0:
        return False
    q = int(-1)
    if t <= -2:
        g = -2 - t
        q = new_vertex(panels)
        if q < 0:
            return False
    v = mesh.vertex[panels.corner[h]]
    w = mesh.vertex[head(panels, h)]
    m = new_sewn_vertex(mesh)
    mesh.x[m] = (mesh.x[v] + mesh.x[w]) * half
    mesh.v[m] = (mesh.v[v] + mesh.v[w]) * half
    mesh.held[m] = (mesh.held[v] + mesh.held[w]) * half
    mesh.area[m] = wp.float64(0.0)
    mesh.drift[m] = wp.min(mesh.drift[v], mesh.drift[w])
    mesh.locked[m] = 0
    mesh.copy[m] = -1
    mesh.origin[m] = -1
    put_middle(mesh, h, m, p)
    share_split(mesh, h, m)
    if t >= 0:
        share_split(mesh, t, m)
    mesh.clock[0] += 1
    touch(mesh, v)
    touch(mesh, w)
    touch(mesh, m)
    touch(mesh, mesh.vertex[apex(panels, h)])
    if t >= 0:
        touch(mesh, mesh.vertex[apex(panels, t)])
    split(panels, h, p)
    if g >= 0:
        touch(mesh, mesh.vertex[apex(panels, g)])
        put_middle(mesh, g, m, q)
        share_split(mesh, g, m)
        split(panels, g, q)
        # h runs to the middle and g from its other end; what leaves the middle is new on either side.
        beyond = panels.leaving[p]
        before = panels.leaving[q]
        sew(panels, h, before)
        sew(panels, beyond, g)
    return True
