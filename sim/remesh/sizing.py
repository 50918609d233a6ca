"""How fine a mesh a cloth needs where, from its shape, its motion and what is near: the sizing field.

Each criterion gives a tensor of panel space for every face, 1/m^2, in which an edge of size 1 reaches as far
as the criterion allows. Gradients are those of linear interpolation over the face, in the face's own panel.

    curvature    (grad n)^T (grad n) / refine_angle^2, n the unit normals of the sewn garment
    velocity     (grad v)^T (grad v) / refine_velocity^2
    compression  the positive part of (-e + sqrt(e^T e - 4 c^2 perp(S2))) / (2 c^2), see `compression`
    obstacles    the average of (grad h) (grad h)^T / h^2, h the distance from a tangent plane of a collider

`clamp` brings each into its bounds; the tensor maximum combines them. The clamp comes first because
criteria of rank one, as of a fold, have no length along it that the maximum could weigh.

Source: Narain, Samii, O'Brien 2012, Adaptive anisotropic remeshing for cloth simulation.
"""

from __future__ import annotations

from functools import reduce

import igl
import numpy as np
from numpy.typing import NDArray

from muslin.garments.errors import InputError
from muslin.garments.mesh import GarmentMesh
from muslin.sim.remesh.metric import (
    clamp,
    faces_to_vertices,
    positive_part,
    square_root,
    tensor_maximum,
    tensors,
)
from muslin.sim.remesh.obstacle import Obstacle
from muslin.sim.remesh.seam_metric import agree_on_seams
from muslin.sim.remesh.settings import RemeshSettings

Array = NDArray[np.float64]

NEARBY = 10.0
"""Distance at which a collider begins to count, in ranges of the contact barrier."""


def sizing_field(
    mesh: GarmentMesh,
    positions: Array,
    settings: RemeshSettings,
    velocities: Array | None = None,
    obstacle: Obstacle | None = None,
    contact_range: float = 2.0e-3,
) -> Array:
    """(P, 2, 2) sizing metric at panel vertices, 1/m^2, within the bounds of `settings`.

    `positions` (V, 3) m and `velocities` (V, 3) m/s of the sewn vertices; without velocities, that criterion
    is off. `obstacle`: the collider where it is now, and `contact_range` m the range of the barrier against
    it: `ContactSettings.range`. On seams both sides ask for the same (`agree_on_seams`). InputError where
    positions or velocities are not of the mesh or not finite.
    """
    _check("positions", positions, mesh)
    if velocities is not None:
        _check("velocities", velocities, mesh)
    faces = face_sizing(mesh, positions, settings, velocities, obstacle, contact_range)
    metric = _clamped(agree_on_seams(mesh, faces_to_vertices(mesh, faces)), settings)
    return np.ascontiguousarray(metric)


def face_sizing(
    mesh: GarmentMesh,
    positions: Array,
    settings: RemeshSettings,
    velocities: Array | None = None,
    obstacle: Obstacle | None = None,
    contact_range: float = 2.0e-3,
) -> Array:
    """(F, 2, 2) sizing metric of the faces before it is averaged; arguments as of `sizing_field`."""
    gradient = PanelGradient(mesh)
    found = []
    if settings.refine_angle is not None or settings.refine_compression is not None:
        bent = squared(gradient(vertex_normals(mesh, positions)))
        if settings.refine_angle is not None:
            found.append(bent / settings.refine_angle**2)
        if settings.refine_compression is not None:
            stretched = squared(gradient(positions))
            found.append(compression(stretched - np.eye(2), bent, settings.refine_compression))
    if settings.refine_velocity is not None and velocities is not None:
        found.append(squared(gradient(velocities)) / settings.refine_velocity**2)
    if settings.refine_obstacle and obstacle is not None:
        found.append(proximity(mesh, positions, obstacle, NEARBY * contact_range, gradient(positions)))
    if not found:
        found.append(np.zeros((len(mesh.faces), 2, 2)))
    return _clamped(reduce(tensor_maximum, [_clamped(one, settings) for one in found]), settings)


class PanelGradient:
    """Gradients over panel space of what is linear on each face: (V, k) on sewn vertices to (F, k, 2), 1/m.

    With panel corners X_i and values y_i, grad y = [y1 - y0, y2 - y0] [X1 - X0, X2 - X0]^-1; of positions
    that is the deformation gradient F.
    """

    def __init__(self, mesh: GarmentMesh) -> None:
        self._faces = np.ascontiguousarray(mesh.faces.T, dtype=np.intp)
        x, y = mesh.panel_vertices.T
        a, b, c = np.ascontiguousarray(mesh.panel_faces.T, dtype=np.intp)
        double = 2.0 * mesh.face_areas
        # Rows of the inverse: what the differences from the first to the second and third corner multiply.
        self._second = np.array([y[c] - y[a], x[a] - x[c]]) / double
        self._third = np.array([y[a] - y[b], x[b] - x[a]]) / double

    def __call__(self, values: Array) -> Array:
        # Component by component in memory: loops over all faces, not over three numbers.
        components = np.ascontiguousarray(values.T)
        a, b, c = (components.take(corner, axis=1) for corner in self._faces)
        b -= a
        c -= a
        gradient = b[:, None] * self._second
        gradient += c[:, None] * self._third
        return np.moveaxis(gradient, 2, 0)


def squared(gradient: Array) -> Array:
    """(F, 2, 2) G^T G of gradients G (F, k, 2)."""
    x, y = gradient[:, :, 0], gradient[:, :, 1]
    return tensors(*(np.einsum("fk,fk->f", p, q) for p, q in ((x, x), (x, y), (y, y))))


def vertex_normals(mesh: GarmentMesh, positions: Array) -> Array:
    """(V, 3) unit normals of the sewn garment, those of the faces around weighted by their angles there.

    On a roll in random triangles, curvature squared comes out 5% too large in the mean and scatters by 23%;
    weights of area make that 14% and 56%, and nearly regular triangles 0.3% and 1% with either. On a border
    only one side has faces: curvature across the border comes out too small in its last row.
    """
    normals = igl.per_vertex_normals(
        np.ascontiguousarray(positions, dtype=np.float64),
        np.ascontiguousarray(mesh.faces, dtype=np.int64),
        igl.PER_VERTEX_NORMALS_WEIGHTING_TYPE_ANGLE,
    )
    # Faces that cancel out, as a fold closed flat, or without area, leave no normal.
    return np.nan_to_num(normals)


def compression(strain: Array, bent: Array, c: float) -> Array:
    """(F, 2, 2) positive part of (-e + sqrt(e^T e - 4 c^2 perp(S2))) / (2 c^2), 1/m^2.

    e = F^T F - I: `strain`, twice Green's, (F, 2, 2); S2 = (grad n)^T (grad n): `bent`, 1/m^2;
    perp(S2) = R S2 R^T, R a quarter turn: its entry along a direction is the squared curvature across it;
    c: refine_compression, metres.

    Of one direction: a sheet of bending stiffness D and stretch stiffness E h, compressed along it by the
    strain -eps and bent across it with curvature k, is a shell, which buckles into waves of wave number q.
    They cost bending D q^4 and, since on a bend waves stretch the sheet, membrane energy E h k^2; compression
    gives back E h (-eps) q^2. With lambda = q^2 and c^2 = D / (E h), waves grow where

        c^2 lambda^2 + eps lambda + k^2 < 0,

    which has solutions where -eps >= 2 c k, the classical buckling strain of cylinders. The larger root,
    with e for eps as the paper has it, is the equation above: the shortest wave that grows. An edge of size 1
    is one radian of it, so a wave gets some six edges. In a flat sheet lambda = -e / c^2. Waves of height a
    take up e = -(a q)^2 / 2, so the wave has height a = sqrt(2) c: cloth that is free to buckle is resolved
    down to about this height, and c is chosen for that, much larger than the bending length of any fabric.

    The root is of a tensor that may be indefinite: its eigenvalues are negative across a bend that is too
    stiff for waves. They are set to zero, which leaves -e / (2 c^2), the wave nearest to growing, and keeps
    the result continuous, so that the mesh does not flicker at the threshold. Where e and perp(S2) share no
    axes, the tensor equation interpolates between directions. Stretched directions get nothing.

    Sources: Narain et al. 2012; Timoshenko, Gere 1961, Theory of elastic stability, chapter 11.
    """
    e, turned = strain, tensors(bent[:, 1, 1], -bent[:, 0, 1], bent[:, 0, 0])
    under = squared(e) - 4.0 * c**2 * turned
    return positive_part(square_root(under) - e) / (2.0 * c**2)


def proximity(
    mesh: GarmentMesh, positions: Array, obstacle: Obstacle, reach: float, deformation: Array
) -> Array:
    """(F, 2, 2) averages over a face's corners of (grad h)(grad h)^T / h^2, 1/m^2.

    At a corner x, h = |x - p| is the distance from the obstacle's tangent plane at p, its point nearest to
    x; grad h = F^T (x - p) / h, F the face's `deformation` (F, 3, 2). A corner with no point of the obstacle
    within `reach`, metres, contributes zero. So h changes by at most itself along an edge, whichever way
    cloth comes down on a surface; along a surface it does not change.
    """
    away, distance = obstacle.nearest(positions, reach)
    direction, near = away / distance[:, None], np.isfinite(distance)
    a, b, c = (near.take(corner) for corner in mesh.faces.T)
    touched = np.flatnonzero(a | b | c)
    fall = deformation[touched]
    part = np.zeros((len(touched), 2, 2))
    for corner in mesh.faces[touched].T:
        x, y = np.einsum("fkj,fk->jf", fall, direction.take(corner, axis=0))
        part += tensors(x * x, x * y, y * y)
    total = np.zeros((len(mesh.faces), 2, 2))
    total[touched] = part / 3.0
    return total


def _clamped(metric: Array, settings: RemeshSettings) -> Array:
    return clamp(metric, settings.size_min, settings.size_max, settings.aspect_min)


def _check(name: str, values: Array, mesh: GarmentMesh) -> None:
    if values.shape != (mesh.num_vertices, 3):
        raise InputError(
            f"{name} has shape {values.shape}; mesh '{mesh.name}' needs ({mesh.num_vertices}, 3)"
        )
    if not np.isfinite(values).all():
        bad = int(np.flatnonzero(~np.isfinite(values).all(axis=1))[0])
        raise InputError(
            f"{name}[{bad}] = {values[bad].tolist()}: must be finite; is the simulation unstable?"
        )
