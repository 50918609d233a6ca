"""Moves of interior vertices within their panels that make triangles regular, as serial Warp kernels."""

import warp as wp

from muslin.sim.remesh.operations import doubled_area
from muslin.sim.remesh.panel_mesh import PanelMesh, apex, around, head
from muslin.sim.remesh.passes import make_delaunay

wp.set_module_options({"enable_backward": False})

FLIP_PASSES = wp.constant(6)  # after each sweep; what is left is flipped after the next one
GOOD = wp.constant(wp.float64(0.8))  # quality above which a move may make the worst triangle worse
ROUNDS = wp.constant(6)  # of that search, each with half the reach of the one before


@wp.func
def quality(a: wp.vec2d, b: wp.vec2d, c: wp.vec2d, m: wp.mat22d) -> wp.float64:
    """4 sqrt(3) |f| / (l_1^2 + l_2^2 + l_3^2) in the metric m: 1 for equilateral, <= 0 for inverted faces.

    (R. Bank and R. Smith 1997, "Mesh smoothing using a posteriori error estimates".)
    """
    u, v, w = b - a, c - b, a - c
    lengths = wp.dot(u, m * u) + wp.dot(v, m * v) + wp.dot(w, m * w)
    # 4 sqrt(3) |f| with the doubled area.
    return wp.float64(2.0) * wp.sqrt(wp.float64(3.0) * wp.determinant(m)) * doubled_area(a, b, c) / lengths


@wp.func
def worst_quality(mesh: PanelMesh, v: int, x: wp.vec2d) -> wp.float64:
    """The least quality of the faces around an interior vertex v if it lay at x, each in the mean metric of
    its corners."""
    first = mesh.leaving[v]
    h = first
    worst = wp.float64(1.0)
    while True:
        i, j = head(mesh, h), apex(mesh, h)
        m = mesh.metric[v] + mesh.metric[i] + mesh.metric[j]
        worst = wp.min(worst, quality(x, mesh.point[i], mesh.point[j], m))
        h = around(mesh, h)
        if h == first or h < 0:
            break
    return worst


@wp.func
def optimal_position(mesh: PanelMesh, v: int) -> wp.vec2d:
    """Mean of the circumcentres c_f of the faces around v, in the metric of each:

        x = sum_f |f| det(M_f) c_f / sum_f |f| det(M_f),   M_f the mean metric of its corners

    (optimal Delaunay triangulation: L. Chen and M. Holst 2011, "Efficient mesh optimization schemes based on
    optimal Delaunay triangulations"; det M ~ 1/h^4 is the density that makes edges of length h). Where the
    face is obtuse in the metric its centroid stands for the circumcentre, which would lie outside.

    c_f solves 2 p . M (c - x) = p . M p for the two edges p from x.
    """
    first = mesh.leaving[v]
    h = first
    x = mesh.point[v]
    weights = wp.float64(0.0)
    shift = wp.vec2d(wp.float64(0.0), wp.float64(0.0))
    third = wp.float64(1.0) / wp.float64(3.0)
    while True:
        i, j = head(mesh, h), apex(mesh, h)
        m = (mesh.metric[v] + mesh.metric[i] + mesh.metric[j]) * third
        p = mesh.point[i] - x
        q = mesh.point[j] - x
        mp, mq = m * p, m * q
        pp, qq, pq = wp.dot(p, mp), wp.dot(q, mq), wp.dot(p, mq)
        doubled = p[0] * q[1] - p[1] * q[0]
        move = (p + q) * third
        if pq > wp.float64(0.0) and pp > pq and qq > pq:
            # Solve [mp; mq] y = (pp, qq)/2 by Cramer's rule.
            det = mp[0] * mq[1] - mp[1] * mq[0]
            s, t = wp.float64(0.5) * pp / det, wp.float64(0.5) * qq / det
            move = wp.vec2d(s * mq[1] - t * mp[1], t * mp[0] - s * mq[0])
        weight = doubled * wp.determinant(m)
        shift += move * weight
        weights += weight
        h = around(mesh, h)
        if h == first or h < 0:
            break
    return x + shift / weights


@wp.kernel
def relax(mesh: PanelMesh, sweeps: int):
    """Sweeps in which every interior vertex moves to its optimal position, or half or a quarter of the way,
    unless its worst face gets worse than before and worse than GOOD; after each, flips."""
    for _ in range(sweeps):
        for v in range(mesh.size[0]):
            if mesh.on_rim[v] == 0 and mesh.leaving[v] >= 0:
                x = mesh.point[v]
                move = optimal_position(mesh, v) - x
                least = wp.min(worst_quality(mesh, v, x), GOOD)
                for _halving in range(3):
                    if worst_quality(mesh, v, x + move) >= least:
                        mesh.point[v] = x + move
                        break
                    move = move * wp.float64(0.5)
        make_delaunay(mesh, FLIP_PASSES)


@wp.func
def search_better(mesh: PanelMesh, v: int, best: wp.float64):
    """Moves v to where its worst face, of quality `best` now, is best, by a pattern search."""
    reach = wp.float64(0.25) * wp.length(mesh.point[head(mesh, mesh.leaving[v])] - mesh.point[v])
    turn = wp.float64(2.0) * wp.float64(wp.pi) / wp.float64(8.0)
    for _ in range(ROUNDS):
        centre = mesh.point[v]
        for k in range(8):
            angle = turn * wp.float64(k)
            x = centre + wp.vec2d(wp.cos(angle), wp.sin(angle)) * reach
            found = worst_quality(mesh, v, x)
            if found > best:
                best = found
                mesh.point[v] = x
        reach = reach * wp.float64(0.5)


@wp.kernel
def mend(mesh: PanelMesh, sweeps: int, enough: wp.float64, bad: wp.array(dtype=wp.int32)):
    """Moves interior vertices of faces of a quality below `enough` to where their worst face is best.

    A pattern search: eight directions around the vertex, the reach halved ROUNDS times; after each sweep,
    flips. bad[0] is the number of vertices found so in the first sweep: none if nothing has moved.
    """
    for sweep in range(sweeps):
        found = int(0)
        for v in range(mesh.size[0]):
            if mesh.on_rim[v] == 0 and mesh.leaving[v] >= 0:
                best = worst_quality(mesh, v, mesh.point[v])
                if best < enough:
                    found += 1
                    search_better(mesh, v, best)
        if sweep == 0:
            bad[0] = found
        if found == 0:
            break
        make_delaunay(mesh, FLIP_PASSES)
