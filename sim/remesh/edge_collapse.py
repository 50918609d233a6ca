"""Collapse of an edge of a garment in motion: when it may be, and what it does to mass and momentum.

Boundaries of panels lose no vertices but those between two straight pieces, so that panel space stays as it
is; momentum that is lost with a vertex goes to the one that takes its place.

Source: Narain, Samii, O'Brien 2012, "Adaptive anisotropic remeshing for cloth simulation", section 4; which
collapses are refused, and how momentum is kept, is our own.
"""

import warp as wp

from muslin.sim.remesh.edge_flip import FLAT
from muslin.sim.remesh.local_crossing import MOST_STRETCH, crosses, normal, place_of, stretch
from muslin.sim.remesh.operations import collapse, collapse_is_manifold, doubled_area, other_end
from muslin.sim.remesh.panel_mesh import PanelMesh, apex, around, head, preceding
from muslin.sim.remesh.passes import squared_length
from muslin.sim.remesh.relax import quality
from muslin.sim.remesh.sewn_mesh import SewnMesh, are_joined, drop_sewn_vertex, touch
from muslin.sim.remesh.surroundings import Surroundings, is_clear, turns_little

wp.set_module_options({"enable_backward": False})

ROOM_TO_GROW = wp.constant(wp.float64(0.9))  # size of the longest edge that a collapse may make
STRAIGHT = wp.constant(wp.float64(1.0e-9))  # sine of the largest turn at a boundary vertex that may go
UPRIGHT = wp.constant(wp.float64(0.05))  # quality that every new face must have


@wp.func
def other_neighbour(panels: PanelMesh, p: int, q: int) -> int:
    """Of the two neighbours along the boundary of a vertex p on it the one that is not q."""
    h = panels.leaving[p]
    after = head(panels, h)
    if after != q:
        return after
    while True:
        g = around(panels, h)
        if g < 0:
            break
        h = g
    return panels.corner[preceding(h)]


@wp.func
def is_straight(panels: PanelMesh, p: int, q: int) -> bool:
    """Whether the boundary goes straight on at p, which has q as one neighbour along it."""
    o = other_neighbour(panels, p, q)
    u = panels.point[q] - panels.point[p]
    v = panels.point[o] - panels.point[p]
    turn = wp.abs(u[0] * v[1] - u[1] * v[0])
    return turn <= STRAIGHT * wp.length(u) * wp.length(v) and wp.dot(u, v) < wp.float64(0.0)


@wp.func
def place_after(mesh: SewnMesh, p: int, q: int) -> wp.vec3d:
    """Where the point of panel space at which p lies will be once p has gone onto q: in the new face in which
    it lies, or least outside."""
    panels = mesh.panels
    x = panels.point[p]
    first = panels.leaving[p]
    h = first
    best = wp.float64(-1.0e30)
    place = mesh.x[mesh.vertex[q]]
    while True:
        i = head(panels, h)
        j = apex(panels, h)
        if i != q and j != q:
            whole = doubled_area(panels.point[q], panels.point[i], panels.point[j])
            wi = doubled_area(panels.point[q], x, panels.point[j]) / whole
            wj = doubled_area(panels.point[q], panels.point[i], x) / whole
            wq = wp.float64(1.0) - wi - wj
            least = wp.min(wq, wp.min(wi, wj))
            if whole > wp.float64(0.0) and least > best:
                best = least
                place = (
                    mesh.x[mesh.vertex[q]] * wq + mesh.x[mesh.vertex[i]] * wi + mesh.x[mesh.vertex[j]] * wj
                )
        h = around(panels, h)
        if h < 0 or h == first:
            break
    return place


@wp.func
def surface_moves(mesh: SewnMesh, p: int, q: int) -> wp.float64:
    """How far the surface of one panel moves at most when p goes onto q: at p, or where a new edge at q
    crosses an old one at p in panel space, for in between the change is linear."""
    panels = mesh.panels
    none = wp.float64(0.0)
    one = wp.float64(1.0)
    xp = mesh.x[mesh.vertex[p]]
    xq = mesh.x[mesh.vertex[q]]
    largest = wp.length(place_after(mesh, p, q) - xp)
    to_q = panels.point[q] - panels.point[p]
    first = panels.leaving[p]
    g = first
    while True:
        j = head(panels, g)
        new = panels.point[j] - panels.point[q]
        h = first
        while j != q:
            i = head(panels, h)
            old = panels.point[i] - panels.point[p]
            cross = old[0] * new[1] - old[1] * new[0]
            if i != q and i != j and cross != none:
                s = (to_q[0] * new[1] - to_q[1] * new[0]) / cross
                r = (to_q[0] * old[1] - to_q[1] * old[0]) / cross
                if s > none and s < one and r > none and r < one:
                    xi = mesh.x[mesh.vertex[i]]
                    xj = mesh.x[mesh.vertex[j]]
                    largest = wp.max(largest, wp.length(xp + (xi - xp) * s - xq - (xj - xq) * r))
            h = around(panels, h)
            if h < 0 or h == first:
                break
        g = around(panels, g)
        if g < 0 or g == first:
            break
    return largest


@wp.func
def fan_fits(mesh: SewnMesh, p: int, q: int, least: wp.float64) -> bool:
    """Whether the faces around the panel vertex p may have q in its place, as far as panel space goes: their
    edges within ROOM_TO_GROW, UPRIGHT, and of a quality of at least `least` in the metric, or as before."""
    panels = mesh.panels
    first = panels.leaving[p]
    h = first
    while True:
        i = head(panels, h)
        j = apex(panels, h)
        if i != q and squared_length(panels, q, i) > ROOM_TO_GROW * ROOM_TO_GROW:
            return False
        if j != q and squared_length(panels, q, j) > ROOM_TO_GROW * ROOM_TO_GROW:
            return False
        if i != q and j != q:
            m = panels.metric[q] + panels.metric[i] + panels.metric[j]
            after = quality(panels.point[q], panels.point[i], panels.point[j], m)
            if after <= UPRIGHT:
                return False
            if after < least and after < quality(panels.point[p], panels.point[i], panels.point[j], m):
                return False
        h = around(panels, h)
        if h < 0 or h == first:
            break
    return True


@wp.func
def fan_is_clear(mesh: SewnMesh, surroundings: Surroundings, p: int, q: int, drift: wp.float64) -> bool:
    """Whether, in the world, the faces around p with q in its place turn little, are not stretched and keep
    clear of everything, where they are within `drift` of the surface as it was loaded."""
    panels = mesh.panels
    first = panels.leaving[p]
    h = first
    x = mesh.x[mesh.vertex[q]]
    gone = wp.vec2i(-1 - mesh.vertex[p], -1)
    while True:
        i = head(panels, h)
        j = apex(panels, h)
        if i != q and j != q:
            xi = mesh.x[mesh.vertex[i]]
            xj = mesh.x[mesh.vertex[j]]
            if not turns_little(normal(mesh.x[mesh.vertex[p]], xi, xj), normal(x, xi, xj)):
                return False
            if stretch(mesh, q, i, j) > wp.max(MOST_STRETCH, stretch(mesh, p, i, j)):
                return False
            if crosses(mesh, mesh.vertex[q], mesh.vertex[i], mesh.vertex[j], gone):
                return False
            place = place_of(mesh, q, i, j, panels.panel[h / 3])
            if not is_clear(surroundings, x, xi, xj, place, drift):
                return False
        h = around(panels, h)
        if h < 0 or h == first:
            break
    return True


@wp.func
def keeps_sewn_manifold(mesh: SewnMesh, p: int, w: int, h: int) -> bool:
    """The link condition among sewn vertices for the fan of the panel vertex p: none of its vertices is
    joined to w already, but those opposite the edge h and, of a seam, opposite it on the other side."""
    panels = mesh.panels
    t = panels.twin[h]
    c = mesh.vertex[apex(panels, h)]
    d = c
    if t >= 0:
        d = mesh.vertex[apex(panels, t)]
    elif t <= -2:
        d = mesh.vertex[apex(panels, -2 - t)]
    first = panels.leaving[p]
    g = first
    while True:
        i = mesh.vertex[head(panels, g)]
        j = mesh.vertex[apex(panels, g)]
        if i != w and i != c and i != d and are_joined(mesh, i, w):
            return False
        if j != w and j != c and j != d and are_joined(mesh, j, w):
            return False
        g = around(panels, g)
        if g < 0 or g == first:
            break
    return True


@wp.func
def hand_over(mesh: SewnMesh, p: int, q: int, drift: wp.float64) -> wp.vec3d:
    """Takes the shares of the faces around p off their corners and gives those of the faces that will be
    there with q in its place, within `drift` of where they were loaded; returns the momentum that this
    adds."""
    panels = mesh.panels
    sixth = wp.float64(1.0) / wp.float64(6.0)
    first = panels.leaving[p]
    h = first
    gained = wp.vec3d(wp.float64(0.0), wp.float64(0.0), wp.float64(0.0))
    vp = mesh.vertex[p]
    vq = mesh.vertex[q]
    while True:
        i = head(panels, h)
        j = apex(panels, h)
        vi = mesh.vertex[i]
        vj = mesh.vertex[j]
        old = doubled_area(panels.point[p], panels.point[i], panels.point[j]) * sixth
        new = wp.float64(0.0)
        if i != q and j != q:
            new = doubled_area(panels.point[q], panels.point[i], panels.point[j]) * sixth
        touch(mesh, vi)
        touch(mesh, vj)
        mesh.drift[vi] = wp.max(mesh.drift[vi], drift)
        mesh.drift[vj] = wp.max(mesh.drift[vj], drift)
        mesh.area[vp] -= old
        mesh.area[vq] += new
        mesh.area[vi] += new - old
        mesh.area[vj] += new - old
        gained += mesh.v[vq] * new - mesh.v[vp] * old + (mesh.v[vi] + mesh.v[vj]) * (new - old)
        h = around(panels, h)
        if h < 0 or h == first:
            break
    return gained


@wp.func
def collapse_if_fine(mesh: SewnMesh, surroundings: Surroundings, h: int, p: int, least: wp.float64) -> bool:
    """Moves p, an end of h, onto the other end, on both sides of a seam, if nothing speaks against it."""
    panels = mesh.panels
    v = mesh.vertex[p]
    q = other_end(panels, h, p)
    w = mesh.vertex[q]
    t = panels.twin[h]
    if mesh.locked[v] != 0 or v == w:
        return False
    # The same on the other side of a seam: half-edge g, p2 goes onto q2.
    g = int(-1)
    p2 = mesh.next_copy[p]
    q2 = int(-1)
    if p2 == p and t <= -2:
        # The tip of a dart, on both sides of its seam at once.
        return False
    if p2 != p:
        if t > -2 or mesh.next_copy[p2] != p:
            return False
        g = -2 - t
        if panels.corner[g] != p2 and head(panels, g) != p2:
            return False
        q2 = other_end(panels, g, p2)
    # What costs least is asked first.
    if panels.on_rim[p] != 0 and not is_straight(panels, p, q):
        return False
    if not fan_fits(mesh, p, q, least):
        return False
    if not collapse_is_manifold(panels, h, p) or not keeps_sewn_manifold(mesh, p, w, h):
        return False
    if g >= 0:
        if not is_straight(panels, p2, q2) or not fan_fits(mesh, p2, q2, least):
            return False
        if not collapse_is_manifold(panels, g, p2) or not keeps_sewn_manifold(mesh, p2, w, g):
            return False
    moved = surface_moves(mesh, p, q)
    if g >= 0:
        moved = wp.max(moved, surface_moves(mesh, p2, q2))
    drift = mesh.drift[v]
    if moved > FLAT:
        drift += moved
        if not fan_is_clear(mesh, surroundings, p, q, drift):
            return False
        if g >= 0 and not fan_is_clear(mesh, surroundings, p2, q2, drift):
            return False
    mesh.clock[0] += 1
    touch(mesh, w)
    gained = hand_over(mesh, p, q, drift)
    if g >= 0:
        gained += hand_over(mesh, p2, q2, drift)
    mesh.v[w] -= gained / mesh.area[w]
    if g >= 0:
        collapse(panels, g, p2)
    collapse(panels, h, p)
    drop_sewn_vertex(mesh, v)
    return True
