"""Contact of one cloth with itself and one moving collider: candidates, barrier, friction, safe steps."""

from __future__ import annotations

from dataclasses import dataclass

import igl
import numpy as np
import warp as wp
from numpy.typing import NDArray

from muslin.sim.cloth import ClothModel
from muslin.sim.contact.barrier import (
    PairMeasure,
    active_pairs,
    barrier_derivatives,
    barrier_value,
    guard_pairs,
)
from muslin.sim.contact.broad_phase import (
    edge_edge_candidates,
    element_bounds,
    sweep_vertices,
    vertex_face_candidates,
)
from muslin.sim.contact.ccd import cut_fractions, go_part_of_way, largest_safe_step
from muslin.sim.contact.friction import FrictionModel, friction_derivatives, friction_value
from muslin.sim.solve.block_matrix import BlockMatrix


@dataclass(frozen=True)
class ContactSettings:
    """`range` m: distance below which the barrier acts; `margin` m that a search looks further; `stiffness`
    J/m^2; friction coefficients; `slip_speed` m/s below which friction sticks smoothly."""

    range: float = 2.0e-3
    margin: float = 2.0e-3
    stiffness: float = 1.0
    friction_body: float = 0.3
    friction_cloth: float = 0.3
    slip_speed: float = 5.0e-3


class _Elements:
    """Faces or edges of one side with their bounding volume hierarchy."""

    def __init__(self, indices: NDArray[np.int32], device: str) -> None:
        self.device = device
        self.count = len(indices)
        self.indices = wp.array(indices, dtype=wp.int32, device=device, ndim=2)
        self.low = wp.zeros(self.count, dtype=wp.vec3, device=device)
        self.high = wp.zeros(self.count, dtype=wp.vec3, device=device)
        self.bvh: wp.Bvh | None = None

    def update(self, vertex_low: wp.array, vertex_high: wp.array, rebuild: bool) -> None:
        if self.count == 0:
            return
        args = [self.indices, vertex_low, vertex_high, self.low, self.high]
        wp.launch(element_bounds, self.count, args, device=self.device)
        if self.bvh is None or rebuild:
            self.bvh = wp.Bvh(self.low, self.high)
        else:
            self.bvh.refit()


class _PairList:
    """Growing list of vertex quadruples; the length is known on the host after a search."""

    def __init__(self, is_edge_edge: bool, capacity: int, device: str) -> None:
        self.is_edge_edge = is_edge_edge
        self.device = device
        self.count = wp.zeros(1, dtype=wp.int32, device=device)
        self.pairs = wp.zeros(capacity, dtype=wp.vec4i, device=device)
        self.length = 0


class ContactSystem:
    """Joint vertex array: V cloth vertices, then N collider vertices.

    `collider_faces` (M, 3) index the collider's own vertices.
    """

    def __init__(
        self,
        cloth: ClothModel,
        collider_faces: NDArray[np.int32],
        num_collider: int,
        settings: ContactSettings,
        device: str,
    ) -> None:
        self.settings = settings
        self.device = device
        self.num_cloth = cloth.num_vertices
        self.num_collider = num_collider
        n = self.num_cloth + self.num_collider
        self.collider_faces = collider_faces
        body_faces = collider_faces.astype(np.int32) + self.num_cloth
        body_edges = (
            igl.edges(collider_faces.astype(np.int64)).astype(np.int32) + self.num_cloth
            if len(collider_faces)
            else np.zeros((0, 2), np.int32)
        )
        self.cloth_faces = _Elements(cloth.faces, device)
        self.cloth_edges = _Elements(cloth.edges, device)
        self.body_faces = _Elements(body_faces, device)
        self.body_edges = _Elements(body_edges, device)
        self.cloth_vertices = wp.array(np.arange(self.num_cloth, dtype=np.int32), device=device)
        self.body_vertices = wp.array(np.arange(self.num_cloth, n, dtype=np.int32), device=device)
        self.vertex_low = wp.zeros(n, dtype=wp.vec3d, device=device)
        self.vertex_high = wp.zeros(n, dtype=wp.vec3d, device=device)

        self.measure = PairMeasure()
        self.measure.vertex_area = wp.array(cloth.vertex_area, dtype=wp.float64, device=device)
        self.measure.num_cloth = self.num_cloth
        self.measure.range_ = settings.range
        self.measure.stiffness = settings.stiffness

        self.lists = [
            _PairList(False, 8 * self.num_cloth, device),
            _PairList(True, 16 * self.num_cloth, device),
        ]
        self.nearest = wp.zeros(1, dtype=wp.float64, device=device)
        self._searches = 0
        self._travelled = 0.0
        self.friction = FrictionModel()
        self.num_friction = 0
        self._still = wp.zeros(n, dtype=wp.vec3d, device=device)
        self._fraction = wp.zeros(n, dtype=wp.float64, device=device)
        self._next_fraction = wp.zeros(n, dtype=wp.float64, device=device)
        self._cut = wp.zeros(1, dtype=wp.int32, device=device)
        self._friction_count = wp.zeros(1, dtype=wp.int32, device=device)
        self._reserve_friction(8 * self.num_cloth)

    def cover(
        self,
        x: wp.array,
        p: wp.array,
        reach: float,
        shared: NDArray[np.float64] | None = None,
        base: wp.array | None = None,
    ) -> None:
        """Make sure that every pair that may come within range on the way from x to x + p is listed.

        `reach` is the largest move |p_i - shared|, metres, `shared` (3,) a motion that all vertices have in
        common. A search looks `margin` further than it must; while the moves since then add up to no more
        than half of that, its list still holds. With `base` vertices may stop anywhere between their base_i
        and p_i.
        """
        if 2.0 * (self._travelled + reach) <= self.settings.margin:
            self._travelled += reach
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
        shift = wp.vec3d() if shared is None else wp.vec3d(*shared)
        ways = [x, self._still if base is None else base, p]
        self._travelled = 0.0
        n = self.num_cloth + self.num_collider
        bounds = [self.vertex_low, self.vertex_high]
        wp.launch(sweep_vertices, n, [*ways, shift, *bounds], device=self.device)
        rebuild = self._searches % 50 == 0
        self._searches += 1
        for elements in (self.cloth_faces, self.cloth_edges, self.body_faces, self.body_edges):
            elements.update(self.vertex_low, self.vertex_high, rebuild)
        radius = self.settings.range + self.settings.margin
        low = self.vertex_low.numpy()[: self.num_cloth].min(axis=0) - radius
        high = self.vertex_high.numpy()[: self.num_cloth].max(axis=0) + radius
        for pairs in self.lists:
            for _ in range(2):
                self._launch_search(pairs, ways, wp.vec3d(*low), wp.vec3d(*high))
                found = int(pairs.count.numpy()[0])
                pairs.length = found
                if found <= len(pairs.pairs):
                    break
                pairs.pairs = wp.zeros(found + found // 2, dtype=wp.vec4i, device=self.device)

    def _launch_search(self, out: _PairList, ways: list[wp.array], low: wp.vec3d, high: wp.vec3d) -> None:
        out.count.zero_()
        radius = self.settings.range + self.settings.margin
        bounds = [self.vertex_low, self.vertex_high]
        has_body = self.body_faces.bvh is not None
        if out.is_edge_edge:
            queries = self.cloth_edges
            for target in (self.cloth_edges, self.body_edges) if has_body else (self.cloth_edges,):
                assert target.bvh is not None
                args = [target.bvh.id, queries.indices, target.indices, int(target is queries), *ways]
                args += [*bounds, radius, out.count, out.pairs]
                wp.launch(edge_edge_candidates, queries.count, args, device=self.device)
            return
        searches = [(self.cloth_vertices, self.cloth_faces)]
        if has_body:
            searches += [(self.cloth_vertices, self.body_faces), (self.body_vertices, self.cloth_faces)]
        for vertices, target in searches:
            assert target.bvh is not None
            args = [target.bvh.id, vertices, target.indices, *ways, *bounds, low, high]
            args += [radius, out.count, out.pairs]
            wp.launch(vertex_face_candidates, len(vertices), args, device=self.device)

    def largest_step(self, x: wp.array, p: wp.array, step: wp.array) -> float:
        """Largest t in (0, 1] at which x + t p keeps all listed pairs apart; `step` is scratch (1,)."""
        step.fill_(1.0)
        for pairs in self.lists:
            if pairs.length:
                args = [x, p, pairs.pairs, pairs.is_edge_edge, step]
                wp.launch(largest_safe_step, pairs.length, args, device=self.device)
        return float(step.numpy()[0])

    def cut_to_safety(
        self, x: wp.array, p: wp.array, step: wp.array, base: wp.array | None = None, passes: int = 4
    ) -> float:
        """Shorten p, vertex by vertex, towards `base` (or rest) until no listed pair touches on x + p.

        What `passes` leave undone is up to the returned t in (0, 1]: x + t p is safe. `step` is scratch (1,).
        """
        base = self._still if base is None else base
        self._fraction.fill_(1.0)
        for _ in range(passes):
            self._cut.zero_()
            wp.copy(self._next_fraction, self._fraction)
            for pairs in self.lists:
                if pairs.length:
                    args = [x, base, p, pairs.pairs, pairs.is_edge_edge, self._fraction]
                    args += [self._next_fraction, self._cut]
                    wp.launch(cut_fractions, pairs.length, args, device=self.device)
            if int(self._cut.numpy()[0]) == 0:
                break
            self._fraction, self._next_fraction = self._next_fraction, self._fraction
        else:
            wp.launch(go_part_of_way, len(x), [base, p, self._fraction], device=self.device)
            return self.largest_step(x, p, step)
        wp.launch(go_part_of_way, len(x), [base, p, self._fraction], device=self.device)
        return 1.0

    def add_value(self, x: wp.array, start: wp.array, energy: wp.array) -> None:
        for pairs in self.lists:
            if pairs.length:
                args = [x, start, pairs.pairs, pairs.is_edge_edge, self.measure, energy]
                wp.launch(barrier_value, pairs.length, args, device=self.device)
        if self.num_friction:
            args = [x, start, self.friction, energy]
            wp.launch(friction_value, self.num_friction, args, device=self.device)

    def add_derivatives(
        self, x: wp.array, start: wp.array, remaining: wp.array, gradient: wp.array, matrix: BlockMatrix
    ) -> None:
        for pairs in self.lists:
            if pairs.length:
                args = [x, start, remaining, pairs.pairs, pairs.is_edge_edge, self.measure]
                args += [gradient, matrix]
                wp.launch(barrier_derivatives, pairs.length, args, device=self.device)
        if self.num_friction:
            args = [x, start, remaining, self.friction, gradient, matrix]
            wp.launch(friction_derivatives, self.num_friction, args, device=self.device)

    def add_guards(self, x: wp.array, p: wp.array, gradient: wp.array, matrix: BlockMatrix) -> None:
        """Warn the Newton system of the pairs that its last direction p would have brought together."""
        for pairs in self.lists:
            if pairs.length:
                args = [x, p, pairs.pairs, pairs.is_edge_edge, self.measure, gradient, matrix]
                wp.launch(guard_pairs, pairs.length, args, device=self.device)

    def begin_step(self, x: wp.array, dt: float, friction: bool = True) -> None:
        """Freeze the contacts at x, which the last search must cover, for this step's friction."""
        self._list_active(x)
        if not friction:
            self.num_friction = 0
        self.friction.num_cloth = self.num_cloth
        self.friction.cloth_body = self.settings.friction_body
        self.friction.cloth_cloth = self.settings.friction_cloth
        self.friction.slip = self.settings.slip_speed * dt

    def smallest_distance(self, x: wp.array) -> float:
        """Smallest distance among the listed pairs, m; infinity where none is listed.

        Lists contacts anew: friction is that of x until the next `begin_step`.
        """
        self._list_active(x)
        return float(self.nearest.numpy()[0])

    def tightest(self, x: wp.array) -> str:
        """The closest listed pair in words: distance, vertices, place."""
        self._list_active(x)
        if self.num_friction == 0:
            return "no contact"
        count = self.num_friction
        pairs = self.friction.pairs.numpy()[:count]
        points = x.numpy()[pairs]
        distance = np.linalg.norm(
            (self.friction.weights.numpy()[:count, :, None] * points).sum(axis=1), axis=1
        )
        k = int(np.argmin(distance))
        cloth = [int(v) for v in pairs[k] if v < self.num_cloth]
        collider = [int(v) - self.num_cloth for v in pairs[k] if v >= self.num_cloth]
        where = ", ".join(f"{value:.3f}" for value in points[k].mean(axis=0))
        return (
            f"{distance[k] * 1e3:.4f} mm between cloth {cloth} and collider {collider or 'none'} at ({where})"
        )

    def _list_active(self, x: wp.array) -> None:
        self._friction_count.zero_()
        self.nearest.fill_(float("inf"))
        f = self.friction
        for pairs in self.lists:
            if pairs.length:
                args = [x, x, pairs.pairs, pairs.is_edge_edge, self.measure, self._friction_count]
                args += [f.pairs, f.weights, f.normal, f.force, self.nearest]
                wp.launch(active_pairs, pairs.length, args, device=self.device)
        self.num_friction = int(self._friction_count.numpy()[0])
        if self.num_friction > len(self.friction.force):
            self._reserve_friction(2 * self.num_friction)
            self._list_active(x)

    def _reserve_friction(self, capacity: int) -> None:
        self.friction.pairs = wp.zeros(capacity, dtype=wp.vec4i, device=self.device)
        self.friction.weights = wp.zeros(capacity, dtype=wp.vec4d, device=self.device)
        self.friction.normal = wp.zeros(capacity, dtype=wp.vec3d, device=self.device)
        self.friction.force = wp.zeros(capacity, dtype=wp.float64, device=self.device)
