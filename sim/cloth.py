"""What of a cloth never changes during a run: connectivity, rest geometry, masses, matrix pattern."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields
from functools import cached_property
from typing import Any

import igl
import numpy as np
from numpy.typing import NDArray

from muslin.garments.mesh import GarmentMesh
from muslin.sim.curvature import curvature_operator
from muslin.sim.material import Fabric


@dataclass(frozen=True, eq=False)
class ClothModel:
    """Rest geometry of one cloth of V vertices, F faces, E edges, H hinges.

    `faces` (F, 3), `edges` (E, 2), `hinges` (H, 4): edge vertices, then the two opposite ones.
    `inverse_rest` (F, 2, 2): inverse of the rest edge matrix in (warp, weft) coordinates, 1/m.
    `rest_area` (F,) m^2; `mass` (V,) kg; `vertex_area` (V,) and `edge_area` (E,) m^2.
    The curvature (K11, K22, K12) of face f is the sum of `curvature_weights` (N, 3), 1/m, times the angles of
    `curvature_hinges` (N,), both from curvature_offsets[f] to curvature_offsets[f + 1].
    `face_fabric` (F,): place in `fabrics` of the fabric of each face.
    """

    faces: NDArray[np.int32]
    edges: NDArray[np.int32]
    hinges: NDArray[np.int32]
    inverse_rest: NDArray[np.float64]
    rest_area: NDArray[np.float64]
    mass: NDArray[np.float64]
    vertex_area: NDArray[np.float64]
    edge_area: NDArray[np.float64]
    curvature_offsets: NDArray[np.int32]
    curvature_hinges: NDArray[np.int32]
    curvature_weights: NDArray[np.float64]
    face_fabric: NDArray[np.int32]
    fabrics: tuple[Fabric, ...]

    @property
    def num_vertices(self) -> int:
        return len(self.mass)

    @cached_property
    def pattern(self) -> tuple[NDArray[np.int32], NDArray[np.int32]]:
        """Sorted rows of the vertex pairs of faces and hinges below the diagonal: offsets (V + 1,), columns
        (L,)."""
        pairs = [_lower_pairs(stencils).reshape(-1, 2) for stencils in (self.faces, self.hinges)]
        keys = np.unique(np.concatenate(pairs) @ np.array([self.num_vertices, 1]))
        rows, columns = keys // self.num_vertices, keys % self.num_vertices
        offsets = np.searchsorted(rows, np.arange(self.num_vertices + 1))
        return offsets.astype(np.int32), columns.astype(np.int32)

    def slots(self, stencils: NDArray[np.int32]) -> NDArray[np.int32]:
        """Positions in the pattern of the vertex pairs of (N, k) stencils, (N, k (k - 1) / 2).

        In order of (1, 0), (2, 0), (2, 1), (3, 0) ... of each stencil's vertices in ascending order.
        """
        offsets, columns = self.pattern
        n = self.num_vertices
        keys = np.repeat(np.arange(n), np.diff(offsets)).astype(np.int64) * n + columns
        return np.searchsorted(keys, _lower_pairs(stencils) @ np.array([n, 1])).astype(np.int32)


def _lower_pairs(stencils: NDArray[np.int32]) -> NDArray[np.int64]:
    """Vertex pairs (N, k (k - 1) / 2, 2) of (N, k) stencils, the larger vertex first."""
    ascending = np.sort(stencils, axis=1).astype(np.int64)
    return np.stack([ascending[:, i] for i in np.tril_indices(stencils.shape[1], -1)], axis=2)


def build_cloth(
    mesh: GarmentMesh, fabric: Fabric | Sequence[Fabric], face_fabric: NDArray[np.int32] | None = None
) -> ClothModel:
    """Rest geometry of `mesh` in `fabric`, or in several, `face_fabric` (F,) saying which is where; the warp
    runs along panel-space +y."""
    fabrics = (fabric,) if isinstance(fabric, Fabric) else tuple(fabric)
    if face_fabric is None:
        face_fabric = np.zeros(len(mesh.faces), np.int32)
    density = np.array([f.density for f in fabrics])[face_fabric]
    material = mesh.panel_vertices[:, ::-1]
    corners = material[mesh.panel_faces]
    rest = np.stack([corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]], axis=2)
    area = 0.5 * np.abs(np.linalg.det(rest))
    faces = mesh.faces.astype(np.int32)
    n = int(faces.max()) + 1
    vertex_area, mass = (
        np.bincount(faces.ravel(), np.repeat(share / 3.0, 3), minlength=n).astype(np.float64)
        for share in (area, density * area)
    )

    edges, _, edge_of_corner = _edges(faces)
    edge_area = np.bincount(edge_of_corner, np.tile(area / 3.0, 3), len(edges)).astype(np.float64)
    hinges, hinge_faces, hinge_corner = _hinges(faces, edges, edge_of_corner)
    offsets, members, weights = _curvature(corners, hinge_faces, hinge_corner)
    return ClothModel(
        faces=faces,
        edges=edges,
        hinges=hinges,
        inverse_rest=np.linalg.inv(rest).astype(np.float64),
        rest_area=area,
        mass=mass,
        vertex_area=vertex_area,
        edge_area=edge_area,
        curvature_offsets=offsets,
        curvature_hinges=members,
        curvature_weights=weights,
        face_fabric=face_fabric,
        fabrics=fabrics,
    )


def merge_cloths(cloths: Sequence[ClothModel]) -> ClothModel:
    """One cloth of several that share no vertex, in this order, each of its own fabrics."""
    vertices, hinges, members, fabrics = (
        np.cumsum([0, *counts])[:-1]
        for counts in (
            [cloth.num_vertices for cloth in cloths],
            [len(cloth.hinges) for cloth in cloths],
            [len(cloth.curvature_hinges) for cloth in cloths],
            [len(cloth.fabrics) for cloth in cloths],
        )
    )
    shift = {"faces": vertices, "edges": vertices, "hinges": vertices, "face_fabric": fabrics}
    shift |= {"curvature_hinges": hinges, "curvature_offsets": members}
    joined: dict[str, Any] = {}
    for name in (entry.name for entry in fields(ClothModel) if entry.name != "fabrics"):
        arrays = [getattr(cloth, name) for cloth in cloths]
        if name in shift:
            arrays = [array + array.dtype.type(by) for array, by in zip(arrays, shift[name], strict=True)]
        if name == "curvature_offsets":
            # The end of one cloth's list is the beginning of the next one's.
            arrays = [arrays[0], *(array[1:] for array in arrays[1:])]
        joined[name] = np.concatenate(arrays)
    return ClothModel(fabrics=tuple(fabric for cloth in cloths for fabric in cloth.fabrics), **joined)


def _curvature(
    corners: NDArray[np.float64], hinge_faces: NDArray[np.int64], hinge_corner: NDArray[np.int64]
) -> tuple[NDArray[np.int32], NDArray[np.int32], NDArray[np.float64]]:
    """Offsets, hinges and weights of curvature as in `ClothModel`, less those that are rounding errors."""
    num_faces, num_hinges = len(corners), len(hinge_faces)
    hinge_of_corner = np.full((num_faces, 3), -1)
    hinge_of_corner[hinge_faces, hinge_corner] = np.arange(num_hinges)[:, None]
    operator = curvature_operator(corners, hinge_of_corner, hinge_faces, hinge_corner).tocoo()
    keep = np.abs(operator.data) > 1e-9 * np.abs(operator.data).max(initial=0.0)
    rows, columns = (index[keep].astype(np.int64) for index in operator.coords)
    keys, position = np.unique(rows // 3 * max(num_hinges, 1) + columns, return_inverse=True)
    weights = np.zeros((len(keys), 3))
    weights[position, rows % 3] = operator.data[keep]
    face, member = np.divmod(keys, max(num_hinges, 1))
    offsets = np.searchsorted(face, np.arange(num_faces + 1))
    return offsets.astype(np.int32), member.astype(np.int32), weights


def _edges(faces: NDArray[np.int32]) -> tuple[NDArray[np.int32], NDArray[np.int32], NDArray[np.int64]]:
    """Unique edges, and for the edge opposite each face corner (column-major over corners) its index."""
    directed, edges, edge_of_corner, _ = igl.unique_edge_map(faces.astype(np.int64))[:4]
    return edges.astype(np.int32), directed.astype(np.int32), edge_of_corner.astype(np.int64)


def _hinges(
    faces: NDArray[np.int32], edges: NDArray[np.int32], edge_of_corner: NDArray[np.int64]
) -> tuple[NDArray[np.int32], NDArray[np.int64], NDArray[np.int64]]:
    """Interior edges as (x0, x1, x2, x3); the faces (H, 2) of x2 and x3, and the corners (H, 2) they are."""
    num_faces = len(faces)
    order = np.argsort(edge_of_corner, kind="stable")
    counts = np.bincount(edge_of_corner, minlength=len(edges))
    starts = np.concatenate([[0], np.cumsum(counts)])[:-1]
    interior = np.flatnonzero(counts == 2)
    first, second = order[starts[interior]], order[starts[interior] + 1]
    hinge_faces = np.stack([first % num_faces, second % num_faces], axis=1)
    hinge_corner = np.stack([first // num_faces, second // num_faces], axis=1)
    # Orientation: the edge as the first face runs through it.
    x0 = faces[hinge_faces[:, 0], (hinge_corner[:, 0] + 1) % 3]
    x1 = faces[hinge_faces[:, 0], (hinge_corner[:, 0] + 2) % 3]
    x2 = faces[hinge_faces[:, 0], hinge_corner[:, 0]]
    x3 = faces[hinge_faces[:, 1], hinge_corner[:, 1]]
    return np.stack([x0, x1, x2, x3], axis=1).astype(np.int32), hinge_faces, hinge_corner
