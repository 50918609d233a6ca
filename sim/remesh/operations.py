"""Flip, split and collapse of an edge in a panel: what they change is the table, not the points.

Names in each: half-edge h runs a -> b with c opposite, its twin t runs b -> a with d opposite.
"""

import warp as wp

from muslin.sim.remesh.panel_mesh import (
    FREE,
    PanelMesh,
    apex,
    around,
    drop_face,
    drop_vertex,
    following,
    head,
    link,
    new_face,
    preceding,
    settle_leaving,
)

wp.set_module_options({"enable_backward": False})


@wp.func
def doubled_area(a: wp.vec2d, b: wp.vec2d, c: wp.vec2d) -> wp.float64:
    """Twice the signed area of a triangle, positive counter-clockwise."""
    u = b - a
    v = c - a
    return u[0] * v[1] - u[1] * v[0]


@wp.func
def put_corners(mesh: PanelMesh, h: int, a: int, b: int, c: int):
    """Makes (a, b, c) the face of h, with h leaving a."""
    mesh.corner[h] = a
    mesh.corner[following(h)] = b
    mesh.corner[preceding(h)] = c


@wp.func
def flip(mesh: PanelMesh, h: int):
    """Replaces the edge a-b, which has two faces, by d-c: faces (d, c, a) and (c, d, b)."""
    t = mesh.twin[h]
    hn, hp = following(h), preceding(h)
    tn, tp = following(t), preceding(t)
    a = mesh.corner[h]
    b = mesh.corner[t]
    c = mesh.corner[hp]
    d = mesh.corner[tp]
    bc = mesh.twin[hn]
    ca = mesh.twin[hp]
    ad = mesh.twin[tn]
    db = mesh.twin[tp]
    put_corners(mesh, h, d, c, a)
    put_corners(mesh, t, c, d, b)
    link(mesh, hn, ca)
    link(mesh, hp, ad)
    link(mesh, tn, db)
    link(mesh, tp, bc)
    settle_leaving(mesh, hn)
    settle_leaving(mesh, hp)
    settle_leaving(mesh, tn)
    settle_leaving(mesh, tp)


@wp.func
def can_flip(mesh: PanelMesh, h: int) -> bool:
    """Whether a-b has two faces whose union is strictly convex at a and b, so that d-c lies inside it, and
    d-c is no edge yet."""
    t = mesh.twin[h]
    if t < 0:
        return False
    c, d = apex(mesh, h), apex(mesh, t)
    x = mesh.point[c]
    y = mesh.point[d]
    a = mesh.point[mesh.corner[h]]
    b = mesh.point[mesh.corner[t]]
    whole = doubled_area(a, b, x) + doubled_area(b, a, y)
    least = wp.float64(1.0e-9) * whole
    if doubled_area(y, x, a) <= least or doubled_area(x, y, b) <= least:
        return False
    return c != d


@wp.func
def split_face(mesh: PanelMesh, h: int, m: int) -> int:
    """Puts m on h: its face becomes (a, m, c) and a new one (m, b, c). Returns the half-edge m -> b; it has
    no twin yet."""
    hn, hp = following(h), preceding(h)
    b = mesh.corner[hn]
    c = mesh.corner[hp]
    f = new_face(mesh)
    mesh.panel[f] = mesh.panel[h / 3]
    s = 3 * f
    put_corners(mesh, s, m, b, c)
    mesh.twin[s] = FREE
    link(mesh, s + 1, mesh.twin[hn])
    mesh.corner[hn] = m
    link(mesh, hn, s + 2)
    settle_leaving(mesh, s + 1)
    settle_leaving(mesh, s + 2)
    return s


@wp.func
def split(mesh: PanelMesh, h: int, m: int):
    """Puts the new vertex m on the edge of h and splits the one or two faces of the panel at it.

    Of a seam this is one side; the caller splits the other and sews the halves with `sew`.
    """
    t = mesh.twin[h]
    if t < 0:
        mesh.on_rim[m] = 1
        s = split_face(mesh, h, m)
        mesh.leaving[m] = s
        mesh.twin[h] = FREE
        # The boundary half-edge that leaves a is still h; that of b is not of this face.
        return
    mesh.on_rim[m] = 0
    s = split_face(mesh, h, m)
    r = split_face(mesh, t, m)
    link(mesh, h, r)
    link(mesh, s, t)
    mesh.leaving[m] = s
    settle_leaving(mesh, h)
    settle_leaving(mesh, t)


@wp.func
def valence(mesh: PanelMesh, v: int) -> int:
    """Number of edges at a vertex."""
    first = mesh.leaving[v]
    h = first
    count = int(0)
    while True:
        count += 1
        h = around(mesh, h)
        if h < 0:
            return count + 1
        if h == first:
            return count
    return count


@wp.func
def joined(mesh: PanelMesh, v: int, w: int) -> bool:
    """Whether an edge joins two vertices of a panel."""
    first = mesh.leaving[v]
    h = first
    while True:
        if head(mesh, h) == w or apex(mesh, h) == w:
            return True
        h = around(mesh, h)
        if h < 0 or h == first:
            return False
    return False


@wp.func
def other_end(mesh: PanelMesh, h: int, v: int) -> int:
    """The end of h that is not v."""
    if mesh.corner[h] == v:
        return head(mesh, h)
    return mesh.corner[h]


@wp.func
def hangs(mesh: PanelMesh, h: int) -> bool:
    """Whether the face of h is joined to its panel by h alone."""
    return mesh.twin[following(h)] < 0 and mesh.twin[preceding(h)] < 0


@wp.func
def collapse_is_manifold(mesh: PanelMesh, h: int, gone: int) -> bool:
    """The link condition for moving `gone`, an end of h, onto the other one: the vertices joined to both are
    those opposite the edge; and `gone` does not lie on the boundary unless the edge does.

    (T. Dey, H. Edelsbrunner, S. Guha, D. Nekhayev 1999, "Topology preserving edge contraction".)
    """
    t = mesh.twin[h]
    kept, c = other_end(mesh, h, gone), apex(mesh, h)
    d = int(-1)
    if hangs(mesh, h):
        return False
    if t >= 0:
        d = apex(mesh, t)
        if mesh.on_rim[gone] != 0 or c == d or hangs(mesh, t):
            return False
    first = mesh.leaving[gone]
    g = first
    while True:
        v, w = head(mesh, g), apex(mesh, g)
        if v != kept and v != c and v != d and joined(mesh, kept, v):
            return False
        if w != kept and w != c and w != d and joined(mesh, kept, w):
            return False
        g = around(mesh, g)
        if g < 0 or g == first:
            break
    return True


@wp.func
def remove_face(mesh: PanelMesh, h: int):
    """Takes the face of h away and joins its two other sides, of which one at least has a face beyond."""
    beyond = mesh.twin[following(h)]
    before = mesh.twin[preceding(h)]
    drop_face(mesh, h / 3)
    if beyond >= 0:
        link(mesh, beyond, before)
        settle_leaving(mesh, beyond)
        settle_leaving(mesh, following(beyond))
    else:
        link(mesh, before, beyond)
    if before >= 0:
        settle_leaving(mesh, before)
        settle_leaving(mesh, following(before))


@wp.func
def collapse(mesh: PanelMesh, h: int, gone: int):
    """Moves `gone`, an end of h, onto the other end and removes the faces of h; `collapse_is_manifold` must
    hold.

    Of a seam this is one side; the caller collapses the other.
    """
    t = mesh.twin[h]
    kept = other_end(mesh, h, gone)
    first = mesh.leaving[gone]
    g = first
    while True:
        mesh.corner[g] = kept
        g = around(mesh, g)
        if g < 0 or g == first:
            break
    if t < 0 and first != h:
        # The boundary now leaves `kept` as it left `gone`.
        mesh.leaving[kept] = first
    remove_face(mesh, h)
    if t >= 0:
        remove_face(mesh, t)
    drop_vertex(mesh, gone)


@wp.func
def sew(mesh: PanelMesh, h: int, g: int):
    """Sews two boundary half-edges together."""
    mesh.twin[h] = -2 - g
    mesh.twin[g] = -2 - h
