"""Split, flip and collapse of an edge of a garment in motion: what they do to its state, and when they may.

Panel space is kept as it is: vertices never move in it, boundaries lose none but those between two straight
pieces. Mass and linear momentum are kept: with a third of each face's area at its corners, in units of the
density, the momentum is sum_f A_f/3 sum_k v_k. A split keeps it by itself; what a flip or a collapse changes
is given back to the vertices that it concerns.

Source: Narain, Samii, O'Brien 2012, "Adaptive anisotropic remeshing for cloth simulation", section 4; which
changes are refused, and how momentum is kept, is our own.
"""

import warp as wp

from muslin.sim.remesh.operations import (
    can_flip,
    collapse,
    collapse_is_manifold,
    doubled_area,
    flip,
    other_end,
    sew,
    split,
)
from muslin.sim.remesh.panel_mesh import PanelMesh, apex, around, head, new_vertex, preceding
from muslin.sim.remesh.passes import is_illegal, squared_length
from muslin.sim.remesh.relax import quality
from muslin.sim.remesh.sewn_mesh import (
    SewnMesh,
    add_copy,
    are_joined,
    drop_sewn_vertex,
    new_sewn_vertex,
    touch,
)
from muslin.sim.remesh.surroundings import Place, Surroundings, is_clear, pierces, turns_little

wp.set_module_options({"enable_backward": False})

ROOM_TO_GROW = wp.constant(wp.float64(0.9))  # size of the longest edge that a collapse may make
STRAIGHT = wp.constant(wp.float64(1.0e-9))  # sine of the largest turn at a boundary vertex that may go
FLAT = wp.constant(wp.float64(1.0e-12))  # metres: moves of the surface below it are none


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
    mesh.locked[m] = 0
    mesh.copy[m] = -1
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


@wp.func
def normal(a: wp.vec3d, b: wp.vec3d, c: wp.vec3d) -> wp.vec3d:
    """Normal of a triangle, of twice its area."""
    return wp.cross(b - a, c - a)


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


@wp.func
def flip_if_better(mesh: SewnMesh, surroundings: Surroundings, h: int) -> bool:
    """Flips an edge that is illegal in the metric, if the new one is no longer than it may be and than both
    were, and the two new faces keep clear of everything and turn little."""
    panels = mesh.panels
    if not is_illegal(panels, h) or not can_flip(panels, h):
        return False
    t = panels.twin[h]
    a = panels.corner[h]
    b = panels.corner[t]
    c = apex(panels, h)
    d = apex(panels, t)
    if squared_length(panels, c, d) > wp.max(wp.float64(1.0), squared_length(panels, a, b)):
        return False
    va = mesh.vertex[a]
    vb = mesh.vertex[b]
    vc = mesh.vertex[c]
    vd = mesh.vertex[d]
    if vc == vd or are_joined(mesh, vc, vd):
        return False
    xa = mesh.x[va]
    xb = mesh.x[vb]
    xc = mesh.x[vc]
    xd = mesh.x[vd]
    # The surface moves most where the diagonals cross in panel space, by x_ab - x_cd.
    pa = panels.point[a]
    ab = panels.point[b] - pa
    cd = panels.point[d] - panels.point[c]
    ac = panels.point[c] - pa
    crossed = ab[0] * cd[1] - ab[1] * cd[0]
    s = (ac[0] * cd[1] - ac[1] * cd[0]) / crossed
    r = (ac[0] * ab[1] - ac[1] * ab[0]) / crossed
    moved = wp.length(xa + (xb - xa) * s - xc - (xd - xc) * r)
    if moved > FLAT:
        old = normal(xa, xb, xc) + normal(xb, xa, xd)
        if not turns_little(old, normal(xd, xc, xa)) or not turns_little(old, normal(xc, xd, xb)):
            return False
        gone = wp.vec2i(h / 3, t / 3)
        if crosses(mesh, vd, vc, va, gone) or crosses(mesh, vc, vd, vb, gone):
            return False
        panel = panels.panel[h / 3]
        if not is_clear(surroundings, xd, xc, xa, place_of(mesh, d, c, a, panel), moved):
            return False
        if not is_clear(surroundings, xc, xd, xb, place_of(mesh, c, d, b, panel), moved):
            return False
    third = wp.float64(1.0) / wp.float64(3.0)
    one = face_area(panels, h) * third
    other = face_area(panels, t) * third
    flip(panels, h)
    mesh.clock[0] += 1
    touch(mesh, va)
    touch(mesh, vb)
    touch(mesh, vc)
    touch(mesh, vd)
    with_a = face_area(panels, h) * third
    with_b = face_area(panels, t) * third
    whole = one + other
    change_a = with_a - whole
    change_b = with_b - whole
    change_c = whole - one
    change_d = whole - other
    mesh.area[va] += change_a
    mesh.area[vb] += change_b
    mesh.area[vc] += change_c
    mesh.area[vd] += change_d
    lost = mesh.v[va] * change_a + mesh.v[vb] * change_b + mesh.v[vc] * change_c + mesh.v[vd] * change_d
    back = lost / (mesh.area[va] + mesh.area[vb] + mesh.area[vc] + mesh.area[vd])
    mesh.v[va] -= back
    mesh.v[vb] -= back
    mesh.v[vc] -= back
    mesh.v[vd] -= back
    return True


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
def fan_may_follow(
    mesh: SewnMesh, surroundings: Surroundings, p: int, q: int, moved: wp.float64, least: wp.float64
) -> bool:
    """Whether the faces around the panel vertex p may have q in its place: upright, of a quality of at least
    `least` in the metric or as before, their edges within ROOM_TO_GROW, and in the world clear of everything
    and little turned."""
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
            before = quality(panels.point[p], panels.point[i], panels.point[j], m)
            after = quality(panels.point[q], panels.point[i], panels.point[j], m)
            if after < least and after < before or after <= wp.float64(0.05):
                return False
            x = mesh.x[mesh.vertex[q]]
            xi = mesh.x[mesh.vertex[i]]
            xj = mesh.x[mesh.vertex[j]]
            if moved > FLAT:
                if not turns_little(normal(mesh.x[mesh.vertex[p]], xi, xj), normal(x, xi, xj)):
                    return False
                gone = wp.vec2i(-1 - mesh.vertex[p], -1)
                if crosses(mesh, mesh.vertex[q], mesh.vertex[i], mesh.vertex[j], gone):
                    return False
                place = place_of(mesh, q, i, j, panels.panel[h / 3])
                if not is_clear(surroundings, x, xi, xj, place, moved):
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
def hand_over(mesh: SewnMesh, p: int, q: int) -> wp.vec3d:
    """Takes the shares of the faces around p off their corners and gives those of the faces that will be
    there with q in its place; returns the momentum that this adds."""
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
    if p2 != p:
        if t > -2 or mesh.next_copy[p2] != p:
            return False
        g = -2 - t
        if panels.corner[g] != p2 and head(panels, g) != p2:
            return False
        q2 = other_end(panels, g, p2)
    if not collapse_is_manifold(panels, h, p) or not keeps_sewn_manifold(mesh, p, w, h):
        return False
    if panels.on_rim[p] != 0 and not is_straight(panels, p, q):
        return False
    moved = wp.length(place_after(mesh, p, q) - mesh.x[v])
    if g >= 0:
        if not collapse_is_manifold(panels, g, p2) or not keeps_sewn_manifold(mesh, p2, w, g):
            return False
        if not is_straight(panels, p2, q2):
            return False
        moved = wp.max(moved, wp.length(place_after(mesh, p2, q2) - mesh.x[v]))
    if not fan_may_follow(mesh, surroundings, p, q, moved, least):
        return False
    if g >= 0 and not fan_may_follow(mesh, surroundings, p2, q2, moved, least):
        return False
    mesh.clock[0] += 1
    touch(mesh, w)
    gained = hand_over(mesh, p, q)
    if g >= 0:
        gained += hand_over(mesh, p2, q2)
    mesh.v[w] -= gained / mesh.area[w]
    if g >= 0:
        collapse(panels, g, p2)
    collapse(panels, h, p)
    drop_sewn_vertex(mesh, v)
    return True
