"""phi: another triangulation of a draped garment, panel by panel in panel space; the same surface."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from muslin.garments.errors import InputError
from muslin.garments.mesh import GarmentMesh
from muslin.sim.remesh.distortion import MAX_DISTORTION, distortion, forced, least_quality
from muslin.sim.remesh.field import Field
from muslin.sim.remesh.fill import Filling, fill
from muslin.sim.remesh.metric import area_density, triangles_asked, uniform
from muslin.sim.remesh.panel_space import PanelSpace
from muslin.sim.remesh.rim import Rim, sample_rim
from muslin.sim.remesh.rings import rings

JITTER = 0.2  # of the edge length: how far boundary vertices move along their curve at random

MENDED = 2.2
"""Distortion above which triangles are mended where more is allowed: uniform targets reach it
nearly everywhere (`docs/remeshing.md`)."""

ATTEMPTS = 3
"""Triangulations drawn before a distortion counts as out of reach."""


@dataclass(frozen=True, eq=False)
class Remeshed:
    """Another triangulation of a garment, and where each of its vertices lies in the source.

    mesh                   the new garment mesh of V' sewn and P' panel vertices
    positions              (V', 3) float64, metres: the source's surface at the new vertices
    source                 the mesh it was made from, of V sewn and P panel vertices
    face, weights          (P',) int64, (P', 3) float64: triangle of the source in which each panel vertex
                           lies, and its barycentric coordinates there
    distortion             the largest of its triangles, see `remesh`
    """

    mesh: GarmentMesh
    positions: NDArray[np.float64]
    source: GarmentMesh
    face: NDArray[np.int64]
    weights: NDArray[np.float64]
    distortion: float

    @cached_property
    def at_vertices(self) -> tuple[NDArray[np.int32], NDArray[np.float64]]:
        """Vertices (V', 3) of the source's triangle in which each sewn vertex lies, and the weights (V', 3).

        Both sides of a seam see the same two vertices, so it does not matter which of them is asked.
        """
        one = np.zeros(self.mesh.num_vertices, dtype=np.int64)
        one[self.mesh.panel_to_vertex] = np.arange(len(self.face))
        return self.source.faces[self.face[one]], self.weights[one]

    def carry(self, values: NDArray[np.float64]) -> NDArray[np.float64]:
        """Values (V', …) at the new sewn vertices of a quantity (V, …) at the source's, linear in triangles:

        q'_v = sum_k weights_vk q[faces[face_v, k]].
        """
        corners, weights = self.at_vertices
        return np.einsum("vk,vk...->v...", weights, np.asarray(values, dtype=np.float64)[corners])

    def carry_panel(self, values: NDArray[np.float64]) -> NDArray[np.float64]:
        """As `carry`, (P', …) at panel vertices of a quantity (P, …) at the source's panel vertices."""
        corners = self.source.panel_faces[self.face]
        return np.einsum("pk,pk...->p...", self.weights, np.asarray(values, dtype=np.float64)[corners])


def remesh(
    mesh: GarmentMesh,
    positions: NDArray[np.float64],
    target: float | Mapping[str, float] | NDArray[np.float64],
    *,
    seed: int = 0,
    max_distortion: float = MAX_DISTORTION,
) -> Remeshed:
    """Another triangulation of the same garment in the same drape (phi of the thesis).

    positions: (V, 3), metres
    target: mean triangle area, m^2; or one a panel, by its name; or a sizing field: metrics (P, 2, 2), 1/m^2,
        at the panel vertices of `mesh`, in which edges get the length 1 in the mean
    seed: another one gives another topology of the same mean area

    Each panel of area A gets as many triangles as its target asks for, A / target or 4/sqrt(3) times the
    integral of sqrt(det M), to within one, unless its boundary alone has more. Corners of panels stay where
    they are; boundaries are sampled anew, both sides of a seam alike (`sample_rim`). Then interior vertices
    are added, moved and joined until edges are as long as the metric says and triangles are regular (`fill`).
    Positions, uv and what is carried are the source's at the same place in panel space.

    max_distortion: the largest distortion of a triangle in the metric (`distortion`), 1 if all were
    equilateral; triangles in corners that the pattern makes sharper than that allows are left out (`forced`).

    Raises InputError for targets that are not positive or too large for a panel, and for a max_distortion
    that is not reached in ATTEMPTS draws.
    """
    if not max_distortion > 1.0:
        raise InputError(f"max_distortion = {max_distortion:g}: must be more than 1, which is equilateral")
    metric = _metric(mesh, target)
    wanted = np.zeros(len(mesh.panel_names))
    np.add.at(wanted, mesh.face_panel, triangles_asked(mesh, metric))
    _check_room(mesh, wanted)
    space = PanelSpace(mesh)
    rng = np.random.default_rng(seed)
    enough = least_quality(min(max_distortion, MENDED))
    reached = np.inf
    for _ in range(ATTEMPTS):
        found, field = _draw(mesh, positions, metric, wanted, space, enough, rng)
        local = field.at(found.mesh.panel_vertices, found.mesh.panel_vertex_panel)
        shape = distortion(found.mesh, local)
        worst = float(shape.max())
        if worst > max_distortion:
            worst = float(shape.max(where=~forced(found.mesh, mesh, metric, max_distortion), initial=1.0))
        if worst <= max_distortion:
            return replace(found, distortion=worst)
        reached = min(reached, worst)
    raise InputError(
        f"max_distortion = {max_distortion:g} is out of reach: the best of {ATTEMPTS} triangulations has "
        f"{reached:.2f}; allow more, choose smaller triangles or another seed"
    )


def _draw(
    mesh: GarmentMesh,
    positions: NDArray[np.float64],
    metric: NDArray[np.float64],
    triangles: NDArray[np.float64],
    space: PanelSpace,
    enough: float,
    rng: np.random.Generator,
) -> tuple[Remeshed, Field]:
    """One triangulation of so many triangles a panel, and the metric that it follows."""
    rim = sample_rim(mesh, metric, rng, JITTER)
    panel = mesh.face_panel[rim.face]
    field = Field(mesh, metric, space, space.lift(rim.points, panel), rim.spacing)
    boundary = rings(rim.points, rim.after, panel)
    # F = 2 I + B - 2 of a disk with I vertices inside and B on its boundary; a hole adds 2.
    nodes = np.bincount(boundary.panel, boundary.length - 2.0, minlength=len(mesh.panel_names))
    wanted = np.maximum(np.round(0.5 * (triangles - nodes)), 0.0).astype(np.int64)
    filling = fill(rim.points, panel, boundary, wanted, field.at, enough, rng)
    return _sewn(mesh, np.asarray(positions, dtype=np.float64), space, rim, filling), field


def _check_room(mesh: GarmentMesh, wanted: NDArray[np.float64]) -> None:
    """InputError if a panel is to have less than one triangle; wanted: (panels,) triangles of each."""
    panel = int(np.argmin(wanted))
    if wanted[panel] < 1.0:
        area = mesh.face_areas[mesh.face_panel == panel].sum()
        raise InputError(
            f"panel '{mesh.panel_names[panel]}' has {area:.3g} m^2, less than one triangle of its target "
            f"area, {area / wanted[panel]:.3g} m^2; choose a smaller one"
        )


def _metric(
    mesh: GarmentMesh, target: float | Mapping[str, float] | NDArray[np.float64]
) -> NDArray[np.float64]:
    """The target as metrics (P, 2, 2) at panel vertices."""
    if isinstance(target, Mapping):
        for name in target:
            if name not in mesh.panel_names:
                raise InputError(
                    f"target area of panel '{name}': the garment has no such panel; it has "
                    f"{', '.join(mesh.panel_names)}"
                )
        missing = [name for name in mesh.panel_names if name not in target]
        if missing:
            raise InputError(f"target areas: panel '{missing[0]}' has none; give one for every panel")
        areas = np.array([target[name] for name in mesh.panel_names], dtype=np.float64)
        return uniform(areas[mesh.panel_vertex_panel])
    if np.ndim(target) == 0:
        return uniform(np.full(len(mesh.panel_vertices), float(np.asarray(target))))
    metric = np.asarray(target, dtype=np.float64)
    wanted = (len(mesh.panel_vertices), 2, 2)
    if metric.shape != wanted or not np.isfinite(metric).all() or not (area_density(metric) > 0.0).all():
        raise InputError(
            f"sizing field of shape {metric.shape}: must be finite, positive definite metrics of "
            f"shape {wanted}, one a panel vertex"
        )
    return metric


def _sewn(
    source: GarmentMesh, positions: NDArray[np.float64], space: PanelSpace, rim: Rim, filling: Filling
) -> Remeshed:
    """The filled panels sewn together: interior vertices follow those of the rim in both numberings."""
    edge = len(rim.vertex)
    inner = len(filling.points) - edge
    panel_vertex_panel = np.zeros(len(filling.points), dtype=np.int32)
    panel_vertex_panel[filling.faces] = filling.panel[:, None]
    face, weights = space.locate(filling.points[edge:], panel_vertex_panel[edge:])
    first = int(rim.vertex.max()) + 1
    panel_to_vertex = np.concatenate([rim.vertex, np.arange(first, first + inner, dtype=np.int32)])
    order = np.argsort(filling.panel, kind="stable")
    panel_faces = filling.faces[order]
    face, weights = np.concatenate([rim.face, face]), np.concatenate([rim.weights, weights])
    uv = np.einsum("pk,pkj->pj", weights, source.uv[source.panel_faces[face]])
    mesh = GarmentMesh(
        faces=panel_to_vertex[panel_faces],
        panel_faces=panel_faces,
        panel_vertices=filling.points,
        panel_to_vertex=panel_to_vertex,
        face_panel=filling.panel[order],
        panel_names=source.panel_names,
        uv=np.clip(uv, 0.0, 1.0),
        name=source.name,
        parameters=dict(source.parameters),
    )
    mesh.validate()
    bare = Remeshed(mesh, np.zeros((mesh.num_vertices, 3)), source, face, weights, np.inf)
    return replace(bare, positions=bare.carry(positions))
