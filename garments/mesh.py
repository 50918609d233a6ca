"""The sewn garment mesh: world connectivity, panel-space coordinates and uv layout."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components

from muslin.garments.errors import InputError
from muslin.garments.half_edges import half_edges, on_boundary, opposite


@dataclass(frozen=True, eq=False)
class GarmentMesh:
    """Triangle mesh of a garment, its panels sewn together vertex for vertex.

    faces: (F, 3) int32, sewn vertices, counter-clockwise seen from outside
    panel_faces: (F, 3) int32, the same triangles over panel vertices
    panel_vertices: (P, 2) float64, panel space (unstrained), metres; a seam vertex has several
    panel_to_vertex: (P,) int32, sewn vertex of each panel vertex
    face_panel: (F,) int32, panel of each triangle
    panel_names: names of the panels
    uv: (P, 2) float64, canonical uv layout, in [0, 1]^2
    name, parameters: the design and its parameters, metres
    """

    faces: NDArray[np.int32]
    panel_faces: NDArray[np.int32]
    panel_vertices: NDArray[np.float64]
    panel_to_vertex: NDArray[np.int32]
    face_panel: NDArray[np.int32]
    panel_names: tuple[str, ...]
    uv: NDArray[np.float64]
    name: str
    parameters: dict[str, float]

    @cached_property
    def num_vertices(self) -> int:
        """Number V of sewn vertices."""
        return int(self.panel_to_vertex.max()) + 1 if len(self.panel_to_vertex) else 0

    @cached_property
    def edges(self) -> NDArray[np.int32]:
        """(E, 2) int32 edges of the sewn mesh, each once, smaller vertex first, sorted."""
        return np.unique(np.sort(half_edges(self.faces), axis=1), axis=0)

    @cached_property
    def boundary_edges(self) -> NDArray[np.int32]:
        """(B, 2) int32 edges with one face, directed as in that face, so the garment lies to their left."""
        return half_edges(self.faces)[on_boundary(self.faces)]

    @cached_property
    def panel_boundary_edges(self) -> NDArray[np.int32]:
        """(B, 2) int32 edges of the panels, seams included, over panel vertices; the panel to their left."""
        return half_edges(self.panel_faces)[on_boundary(self.panel_faces)]

    @cached_property
    def boundary_loops(self) -> tuple[NDArray[np.int32], ...]:
        """Closed boundary curves of the sewn mesh (hem, neckline, cuffs), each as vertices in order."""
        following = {int(a): int(b) for a, b in self.boundary_edges}
        loops = []
        while following:
            start, vertex = next(iter(following.items()))
            loop = [start]
            del following[start]
            while vertex != start:
                loop.append(vertex)
                vertex = following.pop(vertex)
            loops.append(np.array(loop, dtype=np.int32))
        return tuple(loops)

    @cached_property
    def panel_vertex_panel(self) -> NDArray[np.int32]:
        """(P,) int32 panel of each panel vertex."""
        panel = np.full(len(self.panel_vertices), -1, dtype=np.int32)
        panel[self.panel_faces] = self.face_panel[:, None]
        return panel

    @cached_property
    def face_areas(self) -> NDArray[np.float64]:
        """(F,) signed areas in panel space, square metres; positive in a valid mesh."""
        return signed_areas(self.panel_vertices, self.panel_faces)

    @cached_property
    def vertex_areas(self) -> NDArray[np.float64]:
        """(V,) areas in panel space, a third of each adjacent triangle, square metres."""
        areas = np.zeros(self.num_vertices)
        np.add.at(areas, self.faces, self.face_areas[:, None] / 3.0)
        return areas

    @property
    def euler_characteristic(self) -> int:
        """V - E + F of the sewn mesh."""
        return self.num_vertices - len(self.edges) + len(self.faces)

    def validate(self) -> None:
        """InputError unless the mesh is a non-empty, finite, consistently oriented manifold.

        Checks, in this order: shapes, index ranges, finite coordinates, that panel and sewn triangles agree,
        that every panel triangle has positive area, that every vertex is used, at most two faces an edge in
        opposite directions, one fan of faces a vertex, uv in [0, 1].
        """
        self._validate_arrays()
        here = f"mesh '{self.name}'"
        if not np.array_equal(self.panel_to_vertex[self.panel_faces], self.faces):
            raise InputError(
                f"{here}: faces and panel_faces disagree; panel_to_vertex must map one to the other"
            )
        bad = np.flatnonzero(self.face_areas <= 0.0)
        if len(bad):
            raise InputError(
                f"{here}: {len(bad)} panel triangles are inverted or empty, first {bad[0]} with area "
                f"{self.face_areas[bad[0]]:g} m^2; all must be counter-clockwise as seen from outside"
            )
        if (self.panel_vertex_panel[self.panel_faces] != self.face_panel[:, None]).any():
            raise InputError(f"{here}: a panel vertex belongs to two panels; panels share sewn vertices only")
        if (self.panel_vertex_panel < 0).any() or len(np.unique(self.panel_to_vertex)) != self.num_vertices:
            raise InputError(f"{here}: a vertex belongs to no triangle; remove it")
        validate_manifold(self.faces, here)

    def _validate_arrays(self) -> None:
        here = f"mesh '{self.name}'"
        if len(self.faces) == 0 or len(self.panel_vertices) == 0:
            raise InputError(f"{here} is empty: {len(self.faces)} faces, {len(self.panel_vertices)} vertices")
        count_f, count_p = len(self.faces), len(self.panel_vertices)
        expected = {
            "faces": (count_f, 3),
            "panel_faces": (count_f, 3),
            "panel_vertices": (count_p, 2),
            "panel_to_vertex": (count_p,),
            "face_panel": (count_f,),
            "uv": (count_p, 2),
        }
        for key, shape in expected.items():
            if getattr(self, key).shape != shape:
                raise InputError(f"{here}: {key} has shape {getattr(self, key).shape}; it must be {shape}")
        limits = {
            "panel_faces": count_p,
            "panel_to_vertex": self.num_vertices,
            "faces": self.num_vertices,
            "face_panel": len(self.panel_names),
        }
        for key, limit in limits.items():
            array = getattr(self, key)
            if array.min() < 0 or array.max() >= limit:
                raise InputError(
                    f"{here}: {key} holds index {array.min() if array.min() < 0 else array.max()}; "
                    f"allowed: 0 to {limit - 1}"
                )
        for key in ("panel_vertices", "uv"):
            bad = np.flatnonzero(~np.isfinite(getattr(self, key)).all(axis=1))
            if len(bad):
                raise InputError(f"{here}: {key}[{bad[0]}] is NaN or infinite; all must be finite numbers")
        if self.uv.min() < 0.0 or self.uv.max() > 1.0:
            raise InputError(
                f"{here}: uv ranges over {self.uv.min():g} to {self.uv.max():g}; allowed: 0 to 1"
            )


def validate_manifold(faces: NDArray[np.int32], here: str) -> None:
    """InputError unless faces (F, 3) form an oriented manifold with boundary; `here` begins the message."""
    if (faces[:, [0, 1, 2]] == faces[:, [1, 2, 0]]).any():
        bad = np.flatnonzero((faces[:, [0, 1, 2]] == faces[:, [1, 2, 0]]).any(axis=1))[0]
        raise InputError(f"{here}: face {bad} names a vertex twice: {faces[bad].tolist()}")
    # As numbers, which sort many times faster than rows.
    size = int(faces.max()) + 1
    key = np.sort(half_edges(faces).astype(np.int64) @ [size, 1])
    twice = key[1:][key[1:] == key[:-1]]
    if len(twice):
        edge = divmod(int(twice[0]), size)
        raise InputError(
            f"{here} is not manifold: edge {edge[0]}-{edge[1]} is used twice in one direction; "
            "an edge has at most two faces, both counter-clockwise"
        )
    fans = _fans(faces)
    if (fans > 1).any():
        vertex = int(np.argmax(fans > 1))
        raise InputError(
            f"{here} is not manifold: vertex {vertex} joins {fans[vertex]} separate fans of faces"
        )


def signed_areas(points: NDArray[np.float64], faces: NDArray[np.int32]) -> NDArray[np.float64]:
    """(F,) signed areas of the triangles faces (F, 3) over points (N, 2)."""
    a, b, c = points[faces[:, 0]], points[faces[:, 1]], points[faces[:, 2]]
    u, v = b - a, c - a
    return 0.5 * (u[:, 0] * v[:, 1] - u[:, 1] * v[:, 0])


def corner_angles(points: NDArray[np.float64], faces: NDArray[np.int32]) -> NDArray[np.float64]:
    """(F, 3) interior angles, radians, of triangles over points (N, 2) or (N, 3)."""
    angles = np.empty(faces.shape)
    for k in range(3):
        u = points[faces[:, (k + 1) % 3]] - points[faces[:, k]]
        v = points[faces[:, (k + 2) % 3]] - points[faces[:, k]]
        cosine = (u * v).sum(axis=1) / (np.linalg.norm(u, axis=1) * np.linalg.norm(v, axis=1))
        angles[:, k] = np.arccos(np.clip(cosine, -1.0, 1.0))
    return angles


def _fans(faces: NDArray[np.int32]) -> NDArray[np.int64]:
    """(V,) number of edge-connected groups of faces around each vertex.

    In an edge-manifold mesh the faces at a vertex form closed fans and open ones; each open fan has one
    outgoing boundary edge. Corners are joined across interior edges; the groups that remain are the fans.
    """
    count = len(faces)
    corner = np.arange(3 * count).reshape(count, 3)
    # Half edge a->b of a face: corner at a (`tail`), corner at b (`head`).
    half = half_edges(faces)
    tail = np.concatenate([corner[:, 0], corner[:, 1], corner[:, 2]])
    head = np.concatenate([corner[:, 1], corner[:, 2], corner[:, 0]])
    size = int(faces.max()) + 1
    twin = opposite(half[:, 0], half[:, 1], size)
    paired = twin >= 0
    rows = np.concatenate([tail[paired], head[paired]])
    columns = np.concatenate([head[twin[paired]], tail[twin[paired]]])
    graph = coo_matrix((np.ones(len(rows), dtype=np.int8), (rows, columns)), shape=(3 * count, 3 * count))
    _, label = connected_components(graph, directed=False)
    vertex_of_label = np.zeros(label.max() + 1, dtype=np.int64)
    vertex_of_label[label[corner.ravel()]] = faces.ravel()
    return np.bincount(vertex_of_label, minlength=size)
