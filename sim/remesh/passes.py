"""Passes over all panels that make a triangulation follow a metric, as serial Warp kernels.

One thread runs each: every operation changes its neighbours, and a pass over thousands of triangles takes a
millisecond. They run on the CPU on every machine.
"""

import warp as wp

from muslin.sim.remesh.operations import can_flip, collapse, collapse_is_manifold, doubled_area, flip, split
from muslin.sim.remesh.panel_mesh import DEAD, FREE, PanelMesh, apex, around, head, link, new_face, new_vertex

wp.set_module_options({"enable_backward": False})

FLAT = wp.constant(wp.float64(1.0e-12))  # of the metric area of a face: below it counts as none


@wp.func
def squared_length(mesh: PanelMesh, a: int, b: int) -> wp.float64:
    """u . (M_a + M_b)/2 u of the edge u between two vertices."""
    u = mesh.point[b] - mesh.point[a]
    return wp.float64(0.5) * wp.dot(u, (mesh.metric[a] + mesh.metric[b]) * u)


@wp.func
def is_illegal(mesh: PanelMesh, h: int) -> bool:
    """Whether the edge of h violates the Delaunay criterion in the mean metric M of its four vertices.

    The angles opposite the edge sum to more than pi. With u, v from c to a, b and w, z from d to b, a:
    sin(alpha + beta) < 0, and in the metric cos ~ u . M v and sin ~ (u x v) sqrt(det M), so

        (u x v) (w . M z) + (u . M v) (w x z) < 0.
    """
    t = mesh.twin[h]
    if t < 0:
        return False
    ia = mesh.corner[h]
    ib = mesh.corner[t]
    ic = apex(mesh, h)
    id = apex(mesh, t)
    a = mesh.point[ia]
    b = mesh.point[ib]
    c = mesh.point[ic]
    d = mesh.point[id]
    m = mesh.metric[ia] + mesh.metric[ib] + mesh.metric[ic] + mesh.metric[id]
    u, v, w, z = a - c, b - c, b - d, a - d
    sine_c, sine_d = u[0] * v[1] - u[1] * v[0], w[0] * z[1] - w[1] * z[0]
    cosine_c, cosine_d = wp.dot(u, m * v), wp.dot(w, m * z)
    scale = wp.abs(sine_c * cosine_d) + wp.abs(cosine_c * sine_d)
    return sine_c * cosine_d + cosine_c * sine_d < -wp.float64(1.0e-9) * scale


@wp.func
def lies_in(p: wp.vec2d, a: wp.vec2d, b: wp.vec2d, c: wp.vec2d) -> bool:
    """Whether p lies in a counter-clockwise triangle or on its border."""
    none = wp.float64(0.0)
    return doubled_area(a, b, p) >= none and doubled_area(b, c, p) >= none and doubled_area(c, a, p) >= none


@wp.func
def join_side(mesh: PanelMesh, h: int, beyond: int):
    """Gives a side of a new ear its twin, or makes it boundary where `beyond` is FREE."""
    if beyond == FREE:
        mesh.twin[h] = FREE
        mesh.leaving[mesh.corner[h]] = h
    else:
        link(mesh, h, beyond)


@wp.kernel
def clip_ears(
    mesh: PanelMesh,
    panel: wp.array(dtype=wp.int32),
    first: wp.array(dtype=wp.int32),
    length: wp.array(dtype=wp.int32),
    before: wp.array(dtype=wp.int32),
    after: wp.array(dtype=wp.int32),
    vertex: wp.array(dtype=wp.int32),
    edge_of: wp.array(dtype=wp.int32),
    left: wp.array(dtype=wp.int32),
):
    """Triangulates closed polygons without interior vertices by cutting off ears.

    Polygon k, of panel[k], is the ring of length[k] nodes through first[k] that before and after give;
    vertex[n] is the panel vertex of a node and edge_of[n] the half-edge beyond the edge from node n to the
    next (FREE, as there is no face yet). left[k] counts the nodes that could not be cut off: 0 for a polygon
    that does not cross itself. Ears are cut off as they come; flips mend their shape.

    (G. Meisters 1975, "Polygons have ears".)
    """
    for k in range(first.shape[0]):
        count = length[k]
        node = first[k]
        misses = int(0)
        while count > 2 and misses <= count:
            i, j = before[node], after[node]
            a = mesh.point[vertex[i]]
            b = mesh.point[vertex[node]]
            c = mesh.point[vertex[j]]
            is_ear = doubled_area(a, b, c) > FLAT * (wp.length_sq(b - a) + wp.length_sq(c - b))
            n = after[j]
            while is_ear and n != i:
                v = vertex[n]
                if v != vertex[i] and v != vertex[node] and v != vertex[j]:
                    is_ear = not lies_in(mesh.point[v], a, b, c)
                n = after[n]
            if not is_ear and count > 3:
                node = j
                misses += 1
                continue
            f = new_face(mesh)
            mesh.panel[f] = panel[k]
            s = 3 * f
            mesh.corner[s] = vertex[i]
            mesh.corner[s + 1] = vertex[node]
            mesh.corner[s + 2] = vertex[j]
            # The outer sides of the ear, faces or boundary, and the diagonal, along which the ring now runs.
            join_side(mesh, s, edge_of[i])
            join_side(mesh, s + 1, edge_of[node])
            if count == 3:
                join_side(mesh, s + 2, edge_of[j])
            after[i] = j
            before[j] = i
            edge_of[i] = s + 2
            count -= 1
            misses = 0
            node = j
        left[k] = count - 2


@wp.func
def make_delaunay(mesh: PanelMesh, passes: int) -> int:
    """Flips edges until none is illegal, at most so many times over all of them; returns the flips made."""
    total = int(0)
    for _ in range(passes):
        flips = int(0)
        for h in range(3 * mesh.size[1]):
            if mesh.corner[h] != DEAD and h < mesh.twin[h] and is_illegal(mesh, h) and can_flip(mesh, h):
                flip(mesh, h)
                flips += 1
        total += flips
        if flips == 0:
            break
    return total


@wp.kernel
def flip_to_delaunay(mesh: PanelMesh, passes: int):
    """`make_delaunay` of all panels."""
    make_delaunay(mesh, passes)


@wp.kernel
def split_longest(
    mesh: PanelMesh,
    order: wp.array(dtype=wp.int32),
    longest: wp.float64,
    room: wp.array(dtype=wp.int32),
    made: wp.array(dtype=wp.int32),
):
    """Splits edges longer than `longest` in the metric at their middle, in the given order of half-edges.

    room[k] is how many interior vertices panel k may still get; the boundary stays as it is. made[0] counts.
    Ends early where the table is full.
    """
    half = wp.float64(0.5)
    for n in range(order.shape[0]):
        h = order[n]
        if mesh.corner[h] == DEAD or mesh.twin[h] < 0 or room[mesh.panel[h / 3]] <= 0:
            continue
        a = mesh.corner[h]
        b = head(mesh, h)
        if squared_length(mesh, a, b) <= longest * longest:
            continue
        m = new_vertex(mesh)
        if m < 0:
            return
        mesh.point[m] = (mesh.point[a] + mesh.point[b]) * half
        mesh.metric[m] = (mesh.metric[a] + mesh.metric[b]) * half
        split(mesh, h, m)
        room[mesh.panel[h / 3]] -= 1
        made[0] += 1


@wp.kernel
def collapse_shortest(
    mesh: PanelMesh,
    order: wp.array(dtype=wp.int32),
    shortest: wp.float64,
    longest: wp.float64,
    room: wp.array(dtype=wp.int32),
    made: wp.array(dtype=wp.int32),
):
    """Moves interior vertices onto a neighbour nearer than `shortest` in the metric, in the given order of
    half-edges, unless that inverts a face or makes an edge longer than `longest`. room[k] grows by each."""
    for n in range(order.shape[0]):
        h = order[n]
        if mesh.corner[h] == DEAD or mesh.twin[h] < 0:
            continue
        a = mesh.corner[h]
        b = head(mesh, h)
        if mesh.on_rim[a] != 0 or squared_length(mesh, a, b) >= shortest * shortest:
            continue
        if not collapse_is_manifold(mesh, h, a) or not fan_allows(mesh, a, b, longest):
            continue
        panel = mesh.panel[h / 3]
        collapse(mesh, h, a)
        room[panel] += 1
        made[0] += 1


@wp.func
def fan_allows(mesh: PanelMesh, a: int, b: int, longest: wp.float64) -> bool:
    """Whether the faces around a stay upright, and their edges within `longest`, when a moves onto b."""
    first = mesh.leaving[a]
    g = first
    target = mesh.point[b]
    while True:
        v, w = head(mesh, g), apex(mesh, g)
        if v != b and w != b:
            old = doubled_area(mesh.point[a], mesh.point[v], mesh.point[w])
            if doubled_area(target, mesh.point[v], mesh.point[w]) < wp.float64(0.05) * old:
                return False
        if v != b and squared_length(mesh, b, v) > longest * longest:
            return False
        g = around(mesh, g)
        if g < 0 or g == first:
            break
    return True
