"""The lists of pairs that may come within range, and when they have to be looked for again."""

from __future__ import annotations

import igl
import numpy as np
import warp as wp
from numpy.typing import NDArray

from muslin.sim.cloth import ClothModel
from muslin.sim.contact.broad_phase import (
    Ways,
    edges_near_hot_edges,
    element_bounds,
    faces_near_hot_vertices,
    keep_cold_pairs,
    rest,
    spend,
    sweep_vertices,
    vertices_near_hot_faces,
)

REBUILD_EVERY = 50
"""Searches after which the bounding volume hierarchies are built anew; in between they are refitted."""

MOST_HOT = 0.3
"""Share of hot vertices from which on all are looked for at once."""


class PairList:
    """Growing list of vertex quadruples; the length is known on the host after a search.

    `distance`: a lower bound of each pair's distance, metres, exact where it is less than the contact range;
    `trial`: the same for a trial position.
    """

    def __init__(self, is_edge_edge: bool, capacity: int, device: str) -> None:
        self.is_edge_edge = is_edge_edge
        self.device = device
        self.count = wp.zeros(1, dtype=wp.int32, device=device)
        self.length = 0
        self.reserve(capacity)

    def reserve(self, capacity: int) -> None:
        self.pairs = wp.zeros(capacity, dtype=wp.vec4i, device=self.device)
        self._kept = wp.zeros(capacity, dtype=wp.vec4i, device=self.device)
        self.distance = wp.zeros(capacity, dtype=wp.float64, device=self.device)
        self.trial = wp.zeros(capacity, dtype=wp.float64, device=self.device)

    def drop_hot(self, hot: wp.array) -> None:
        """Leave out the pairs with a hot vertex."""
        self.count.zero_()
        if self.length:
            args = [self.pairs, self.distance, hot, self.count, self._kept, self.trial]
            wp.launch(keep_cold_pairs, self.length, args, device=self.device)
            self.pairs, self._kept = self._kept, self.pairs
            self.accept_trial()

    def accept_trial(self) -> None:
        """The trial position is where things are now."""
        self.distance, self.trial = self.trial, self.distance


class _Elements:
    """Vertices, edges or faces of one side with their bounding volume hierarchy."""

    def __init__(self, indices: NDArray[np.int32], device: str) -> None:
        self.device = device
        self.count = len(indices)
        self.indices = wp.array(indices, dtype=wp.int32, device=device, ndim=2)
        self.low = wp.zeros(self.count, dtype=wp.vec3, device=device)
        self.high = wp.zeros(self.count, dtype=wp.vec3, device=device)
        self.bvh: wp.Bvh | None = None

    def update(self, ways: Ways, rebuild: bool) -> None:
        if self.count == 0:
            return
        args = [self.indices, ways.low, ways.high, self.low, self.high]
        wp.launch(element_bounds, self.count, args, device=self.device)
        if self.bvh is None or rebuild:
            self.bvh = wp.Bvh(self.low, self.high)
        else:
            self.bvh.refit()


class PairSearch:
    """Vertex-face and edge-edge pairs within `range_` of each other, with at least one side on the cloth.

    Joint vertex array: V cloth vertices, then N of the collider. A search looks `margin` further than it
    must, so that its lists hold until two vertices have moved by that much between them. A vertex that has
    moved by half of it is hot: its primitives are looked for anew, the rest of the lists stays.
    """

    def __init__(
        self,
        cloth: ClothModel,
        collider_faces: NDArray[np.int32],
        num_collider: int,
        range_: float,
        margin: float,
        device: str,
    ) -> None:
        self.device = device
        self.radius = range_ + margin
        self.budget = 0.5 * margin
        self.num_cloth = cloth.num_vertices
        n = self.num_cloth + num_collider
        everyone = np.arange(n, dtype=np.int32)[:, None]
        edges = igl.edges(collider_faces.astype(np.int64)) if len(collider_faces) else np.zeros((0, 2))
        self.cloth_faces = _Elements(cloth.faces, device)
        self.cloth_edges = _Elements(cloth.edges, device)
        self.cloth_vertices = _Elements(everyone[: self.num_cloth], device)
        self.body_faces = _Elements((collider_faces + self.num_cloth).astype(np.int32), device)
        self.body_edges = _Elements((edges + self.num_cloth).astype(np.int32), device)
        self.body_vertices = _Elements(
            everyone[self.num_cloth :] if len(collider_faces) else everyone[:0], device
        )
        self._cloth = [self.cloth_faces, self.cloth_edges, self.cloth_vertices]
        self._collider = [self.body_faces, self.body_edges, self.body_vertices]
        self._boxes_left_behind = False
        ways = Ways()
        ways.low = wp.zeros(n, dtype=wp.vec3d, device=device)
        ways.high = wp.zeros(n, dtype=wp.vec3d, device=device)
        ways.way = wp.zeros(n, dtype=wp.float64, device=device)
        ways.hot = wp.zeros(n, dtype=wp.int32, device=device)
        self.ways = ways
        self.travelled = wp.zeros(n, dtype=wp.float64, device=device)
        self.still = wp.zeros(n, dtype=wp.vec3d, device=device)
        self._count = wp.zeros(2, dtype=wp.int32, device=device)
        self._whole = wp.array((everyone[:, 0] < self.num_cloth).astype(np.int32), device=device)
        self.lists = [
            PairList(False, 8 * self.num_cloth, device),
            PairList(True, 16 * self.num_cloth, device),
        ]
        self.searches = 0

    def cover(
        self,
        x: wp.array,
        p: wp.array,
        shared: NDArray[np.float64] | None = None,
        base: wp.array | None = None,
    ) -> None:
        """Make sure that every pair that may come within range on the way from x to x + p is listed.

        `shared` (3,) is a motion that all vertices have in common. With `base`, vertices may stop anywhere
        between base_i and p_i.
        """
        base = self.still if base is None else base
        n = len(x)
        self._count.zero_()
        shift = wp.vec3d() if shared is None else wp.vec3d(*shared)
        args = [base, p, shift, self.num_cloth, self.budget, self.ways.way, self.travelled]
        wp.launch(spend, n, [*args, self.ways.hot, self._count], device=self.device)
        hot, hot_collider = self._count.numpy()
        if hot_collider or hot > MOST_HOT * self.num_cloth:
            self.search(x, p, shared, base)
        elif hot:
            for pairs in self.lists:
                pairs.drop_hot(self.ways.hot)
            elsewhere = self._boxes_left_behind or shared is not None
            if self._look(x, p, base, shift, self._cloth + (self._collider if elsewhere else [])):
                self._boxes_left_behind = shared is not None
            else:
                self.search(x, p, shared, base)

    def search(
        self,
        x: wp.array,
        p: wp.array,
        shared: NDArray[np.float64] | None = None,
        base: wp.array | None = None,
    ) -> None:
        """List every pair that may come within range and `margin` on the way from x to x + p."""
        base = self.still if base is None else base
        shift = wp.vec3d() if shared is None else wp.vec3d(*shared)
        self.searches += 1
        args = [base, p, shift, self.num_cloth, self.budget, self.ways.way, self.travelled]
        wp.launch(spend, len(x), [*args, self.ways.hot, self._count], device=self.device)
        self.travelled.zero_()
        while True:
            wp.copy(self.ways.hot, self._whole)
            for pairs in self.lists:
                pairs.count.zero_()
            if self._look(x, p, base, shift, self._cloth[:2] + self._collider):
                # Boxes that leave out a motion all have in common are not where the collider is afterwards.
                self._boxes_left_behind = shared is not None
                return

    def _look(
        self, x: wp.array, p: wp.array, base: wp.array, shift: wp.vec3d, moved: list[_Elements]
    ) -> bool:
        """Append the pairs of hot vertices; False where a list was too short: it has grown.

        Boxes of primitives that have not `moved` are where they were.
        """
        ways = self.ways
        ways.x, ways.b, ways.p = x, base, p
        wp.launch(sweep_vertices, len(x), [x, base, p, shift, ways.low, ways.high], device=self.device)
        for elements in moved:
            elements.update(ways, self.searches % REBUILD_EVERY == 1)
        near, crossing = self.lists
        for vertices, first in ((self.cloth_vertices, 0), (self.body_vertices, self.num_cloth)):
            # Cold vertices of the cloth there are only where some primitives are looked for, not all.
            if vertices.bvh is not None and (first > 0 or vertices in moved):
                args = [vertices.bvh.id, first, self.cloth_faces.indices]
                self._launch(vertices_near_hot_faces, self.cloth_faces.count, args, near)
        for faces in (self.cloth_faces, self.body_faces):
            if faces.bvh is not None:
                args = [faces.bvh.id, faces.indices]
                self._launch(faces_near_hot_vertices, self.num_cloth, args, near)
        for edges in (self.cloth_edges, self.body_edges):
            if edges.bvh is not None:
                same = int(edges is self.cloth_edges)
                args = [edges.bvh.id, self.cloth_edges.indices, edges.indices, same]
                self._launch(edges_near_hot_edges, self.cloth_edges.count, args, crossing)
        wp.launch(rest, len(x), [ways.hot, self.travelled], device=self.device)
        enough = True
        for pairs in self.lists:
            pairs.length = int(pairs.count.numpy()[0])
            if pairs.length > len(pairs.pairs):
                pairs.reserve(pairs.length + pairs.length // 2)
                enough = False
        return enough

    def _launch(self, kernel: wp.Kernel, count: int, args: list, pairs: PairList) -> None:
        args = [*args, self.ways, self.radius, pairs.count, pairs.pairs, pairs.distance]
        wp.launch(kernel, count, args, device=self.device)
