"""Flip of an edge of a garment in motion: when it may be, and what it does to mass and momentum.

Source: Narain, Samii, O'Brien 2012, "Adaptive anisotropic remeshing for cloth simulation", section 4; which
flips are refused, and how momentum is kept, is our own.
"""

import warp as wp

from muslin.sim.remesh.edge_split import face_area
from muslin.sim.remesh.local_crossing import MOST_STRETCH, crosses, normal, place_of, stretch
from muslin.sim.remesh.operations import can_flip, flip
from muslin.sim.remesh.panel_mesh import apex
from muslin.sim.remesh.passes import is_illegal, squared_length
from muslin.sim.remesh.sewn_mesh import PINNED, SewnMesh, are_joined, touch
from muslin.sim.remesh.surroundings import Surroundings, is_clear, turns_little

wp.set_module_options({"enable_backward": False})

FLAT = wp.constant(wp.float64(1.0e-12))  # metres: moves of the surface below it are none


@wp.func
def flip_if_better(mesh: SewnMesh, surroundings: Surroundings, h: int) -> bool:
    """Flips an edge that is illegal in the metric, if the new one is no longer than it may be and than both
    were, and the two new faces keep clear of everything, turn little and are not stretched."""
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
    if mesh.locked[vc] == PINNED and mesh.locked[vd] == PINNED:
        # It could not be split any more.
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
    # Both faces lie within that of all their corners.
    drift = wp.min(mesh.drift[va], mesh.drift[vb])
    drift = wp.max(wp.min(drift, mesh.drift[vc]), wp.min(drift, mesh.drift[vd]))
    if moved > FLAT:
        drift += moved
        old = normal(xa, xb, xc) + normal(xb, xa, xd)
        if not turns_little(old, normal(xd, xc, xa)) or not turns_little(old, normal(xc, xd, xb)):
            return False
        most = wp.max(MOST_STRETCH, wp.max(stretch(mesh, a, b, c), stretch(mesh, b, a, d)))
        if stretch(mesh, d, c, a) > most or stretch(mesh, c, d, b) > most:
            return False
        gone = wp.vec2i(h / 3, t / 3)
        if crosses(mesh, vd, vc, va, gone) or crosses(mesh, vc, vd, vb, gone):
            return False
        panel = panels.panel[h / 3]
        if not is_clear(surroundings, xd, xc, xa, place_of(mesh, d, c, a, panel), drift):
            return False
        if not is_clear(surroundings, xc, xd, xb, place_of(mesh, c, d, b, panel), drift):
            return False
    third = wp.float64(1.0) / wp.float64(3.0)
    one = face_area(panels, h) * third
    other = face_area(panels, t) * third
    flip(panels, h)
    mesh.drift[va] = wp.max(mesh.drift[va], drift)
    mesh.drift[vb] = wp.max(mesh.drift[vb], drift)
    mesh.drift[vc] = wp.max(mesh.drift[vc], drift)
    mesh.drift[vd] = wp.max(mesh.drift[vd], drift)
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
