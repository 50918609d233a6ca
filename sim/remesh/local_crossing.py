"""Where a new triangle of a garment would lie, how stretched, and whether it would cross faces around its
vertices."""

import warp as wp

from muslin.sim.remesh.panel_mesh import apex, around, head
from muslin.sim.remesh.sewn_mesh import SewnMesh
from muslin.sim.remesh.surroundings import Place, pierces

wp.set_module_options({"enable_backward": False})


@wp.func
def normal(a: wp.vec3d, b: wp.vec3d, c: wp.vec3d) -> wp.vec3d:
    """Normal of a triangle, of twice its area."""
    return wp.cross(b - a, c - a)


# Flips and collapses may bring it about. More of it, where triangles cut folds short, sets cloth in motion.
MOST_STRETCH = wp.constant(wp.float64(1.05))


@wp.func
def stretch(mesh: SewnMesh, a: int, b: int, c: int) -> wp.float64:
    """Largest principal stretch of the triangle of three panel vertices: root of the larger eigenvalue of
    F^T F, F = [x_b - x_a, x_c - x_a] D^-1, D the same in panel space."""
    p = mesh.panels.point[b] - mesh.panels.point[a]
    q = mesh.panels.point[c] - mesh.panels.point[a]
    det = p[0] * q[1] - p[1] * q[0]
    u = mesh.x[mesh.vertex[b]] - mesh.x[mesh.vertex[a]]
    v = mesh.x[mesh.vertex[c]] - mesh.x[mesh.vertex[a]]
    along = (u * q[1] - v * p[1]) / det
    across = (v * p[0] - u * q[0]) / det
    half = wp.float64(0.5)
    mean = half * (wp.dot(along, along) + wp.dot(across, across))
    difference = half * (wp.dot(along, along) - wp.dot(across, across))
    shear = wp.dot(along, across)
    return wp.sqrt(mean + wp.sqrt(difference * difference + shear * shear))


@wp.func
def place_of(mesh: SewnMesh, a: int, b: int, c: int, panel: int) -> Place:
    """Where the triangle of three panel vertices lies."""
    place = Place()
    place.a = mesh.panels.point[a]
    place.b = mesh.panels.point[b]
    place.c = mesh.panels.point[c]
    place.home = wp.vec3i(mesh.home[a], mesh.home[b], mesh.home[c])
    place.panel = panel
    return place


@wp.func
def crosses_face(mesh: SewnMesh, va: int, vb: int, vc: int, h: int) -> bool:
    """Whether the triangle of three sewn vertices crosses the face of h: edges of either through the other,
    but those that end in it."""
    a = mesh.x[va]
    b = mesh.x[vb]
    c = mesh.x[vc]
    vp = mesh.vertex[mesh.panels.corner[h]]
    vq = mesh.vertex[head(mesh.panels, h)]
    vr = mesh.vertex[apex(mesh.panels, h)]
    p = mesh.x[vp]
    q = mesh.x[vq]
    r = mesh.x[vr]
    shares_p = vp == va or vp == vb or vp == vc
    shares_q = vq == va or vq == vb or vq == vc
    shares_r = vr == va or vr == vb or vr == vc
    if not shares_p and not shares_q and pierces(p, q, a, b, c):
        return True
    if not shares_q and not shares_r and pierces(q, r, a, b, c):
        return True
    if not shares_r and not shares_p and pierces(r, p, a, b, c):
        return True
    shares_a = va == vp or va == vq or va == vr
    shares_b = vb == vp or vb == vq or vb == vr
    shares_c = vc == vp or vc == vq or vc == vr
    if not shares_a and not shares_b and pierces(a, b, p, q, r):
        return True
    if not shares_b and not shares_c and pierces(b, c, p, q, r):
        return True
    return not shares_c and not shares_a and pierces(c, a, p, q, r)


@wp.func
def crosses_around(mesh: SewnMesh, va: int, vb: int, vc: int, centre: int, without: wp.vec2i) -> bool:
    """Whether the triangle of three sewn vertices crosses a face around `centre`, one of them. Faces with one
    of the half-edges or of the vertex `without` = (face, face) or (-1 - vertex, any) will be no more."""
    panels = mesh.panels
    p = mesh.copy[centre]
    while True:
        first = panels.leaving[p]
        h = first
        while True:
            f = h / 3
            gone = f == without[0] or f == without[1]
            if without[0] < 0:
                v = -1 - without[0]
                gone = mesh.vertex[head(panels, h)] == v or mesh.vertex[apex(panels, h)] == v
            if not gone and crosses_face(mesh, va, vb, vc, h):
                return True
            h = around(panels, h)
            if h < 0 or h == first:
                break
        p = mesh.next_copy[p]
        if p == mesh.copy[centre]:
            break
    return False


@wp.func
def crosses(mesh: SewnMesh, va: int, vb: int, vc: int, without: wp.vec2i) -> bool:
    """Whether the triangle of three sewn vertices crosses a face around one of them; see `crosses_around`."""
    if crosses_around(mesh, va, vb, vc, va, without) or crosses_around(mesh, va, vb, vc, vb, without):
        return True
    return crosses_around(mesh, va, vb, vc, vc, without)
