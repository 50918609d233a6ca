"""Contact of one cloth with itself and one moving collider: candidates, barrier, friction, safe steps."""

from __future__ import annotations

from dataclasses import dataclass

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
    lower_distances,
    mark_near,
)
from muslin.sim.contact.ccd import cut_fractions, go_part_of_way, largest_safe_step
from muslin.sim.contact.friction import (
    FrictionModel,
    friction_derivatives,
    friction_value,
    set_bristles,
    share_bristles,
)
from muslin.sim.contact.pair_list import PairList
from muslin.sim.contact.patches import Patches
from muslin.sim.contact.search import PairSearch
from muslin.sim.solve.block_matrix import BlockMatrix


@dataclass(frozen=True)
class ContactSettings:
    """`range` m: distance below which the barrier acts; `margin` m that a search looks further; `stiffness`
    J/m^2; friction coefficients; `slip` m: what friction gives way before it slides."""

    range: float = 2.0e-3
    margin: float = 3.0e-3
    stiffness: float = 1.0
    friction_body: float = 0.3
    friction_cloth: float = 0.3
    slip: float = 1.0e-4


MAX_CUTS = 16
"""Passes over the pairs in which moves are shortened vertex by vertex."""

MAX_ROUNDS = 4
"""How often moves are shortened until the pairs on the way that is left are all known."""


class ContactSystem:
    """Joint vertex array: V cloth vertices, then N collider vertices, at `points` (V + N, 3) to begin with.

    `collider_faces` (M, 3) index the collider's own vertices.
    """

    def __init__(
        self,
        cloth: ClothModel,
        collider_faces: NDArray[np.int32],
        points: NDArray[np.float64],
        settings: ContactSettings,
        device: str,
        collider: Patches | None = None,
    ) -> None:
        """`collider`: its patches, if they are known from another cloth's contacts."""
        self.settings = settings
        self.device = device
        self.num_cloth = cloth.num_vertices
        n = len(points)
        self.collider_faces = collider_faces
        distances = (settings.range, settings.margin)
        self.search = PairSearch(cloth, collider_faces, points, *distances, device, collider)
        self.measure = PairMeasure()
        self.measure.vertex_area = wp.array(cloth.vertex_area, dtype=wp.float64, device=device)
        self.measure.num_cloth = self.num_cloth
        self.measure.range_ = settings.range
        self.measure.stiffness = settings.stiffness

        self.nearest = wp.zeros(1, dtype=wp.float64, device=device)
        self.friction = FrictionModel()
        self.friction.num_cloth = self.num_cloth
        self.friction.cloth_body = settings.friction_body
        self.friction.cloth_cloth = settings.friction_cloth
        self.friction.slip = settings.slip
        self.num_friction = 0
        self._before, self._fraction, self._after = (
            wp.zeros(n, dtype=wp.float64, device=device) for _ in range(3)
        )
        self._near = wp.zeros(n, dtype=wp.int32, device=device)
        self._cut = wp.zeros(1, dtype=wp.int32, device=device)
        self.friction.bristle = wp.zeros(self.num_cloth, dtype=wp.vec3d, device=device)
        self._bristle_total = wp.zeros(self.num_cloth, dtype=wp.vec3d, device=device)
        self._bristle_weight = wp.zeros(self.num_cloth, dtype=wp.float64, device=device)
        self._friction_count = wp.zeros(1, dtype=wp.int32, device=device)
        self._reserve_friction(8 * self.num_cloth)

    @property
    def lists(self) -> list[PairList]:
        """The pairs that may come within range."""
        return self.search.lists

    def largest_step(self, x: wp.array, p: wp.array, step: wp.array) -> float:
        """Largest t in (0, 1] at which x + t p keeps all listed pairs apart; `step` is scratch (1,)."""
        step.fill_(1.0)
        for pairs in self.lists:
            if pairs.length:
                args = [x, p, pairs.pairs, pairs.is_edge_edge, step]
                wp.launch(largest_safe_step, pairs.length, args, device=self.device)
        return float(step.numpy()[0])

    def cut_to_safety(
        self,
        x: wp.array,
        p: wp.array,
        step: wp.array,
        base: wp.array | None = None,
    ) -> float:
        """Shorten p, vertex by vertex, towards `base` (or rest) until no pair touches on x + p.

        What that leaves undone is up to the returned t in (0, 1]: x + t p is safe. p must be covered, and is
        again when it has been shortened. `step` is scratch (1,).
        """
        for _ in range(MAX_ROUNDS):
            passes = self._shorten(x, p, self.search.still if base is None else base)
            if passes == 0:
                return 1.0
            # Some are slower now than those around them: pairs may meet that would have moved as one.
            looked = self.search.cover(x, p, self._fraction)
            if passes == MAX_CUTS:
                break
            if looked == 0:
                return 1.0
        return self.largest_step(x, p, step)

    def _shorten(self, x: wp.array, p: wp.array, base: wp.array) -> int:
        """Passes over the listed pairs that shortened p; after `MAX_CUTS` of them some may still touch."""
        before, fraction, after = self._before, self._fraction, self._after
        before.zero_()
        fraction.fill_(1.0)
        for passes in range(MAX_CUTS + 1):
            if passes == MAX_CUTS:
                break
            self._cut.zero_()
            wp.copy(after, fraction)
            for pairs in self.lists:
                if pairs.length:
                    args = [x, base, p, pairs.pairs, pairs.owner, self.search.most, pairs.distance]
                    args += [pairs.is_edge_edge, passes == 0, before, fraction, after, self._cut]
                    wp.launch(cut_fractions, pairs.length, args, device=self.device)
            if int(self._cut.numpy()[0]) == 0:
                break
            before, fraction, after = fraction, after, before
        self._before, self._fraction, self._after = before, fraction, after
        wp.launch(go_part_of_way, len(x), [base, p, fraction], device=self.device)
        return passes

    def lower_distances(self, step: float) -> None:
        """So much of the covered move has been made."""
        for pairs in self.lists:
            if pairs.length:
                args = [step, pairs.owner, self.search.most, pairs.distance]
                wp.launch(lower_distances, pairs.length, args, device=self.device)

    def accept_trial(self) -> None:
        """The positions of the last `add_value` are where things are now."""
        for pairs in self.lists:
            pairs.accept_trial()

    def add_value(self, x: wp.array, step: float, start: wp.array, energy: wp.array) -> None:
        """Energy at x, by no more than `step` of the last covered move away from where things are."""
        for pairs in self.lists:
            if pairs.length:
                args = [x, step, start, pairs.pairs, pairs.owner, self.search.most, pairs.distance]
                args += [pairs.is_edge_edge, self.measure, pairs.trial, energy]
                wp.launch(barrier_value, pairs.length, args, device=self.device)
        if self.num_friction:
            args = [x, start, self.friction, energy]
            wp.launch(friction_value, self.num_friction, args, device=self.device)

    def add_derivatives(
        self, x: wp.array, start: wp.array, remaining: wp.array, gradient: wp.array, matrix: BlockMatrix
    ) -> None:
        for pairs in self.lists:
            if pairs.length:
                args = [x, start, remaining, pairs.pairs, pairs.distance, pairs.is_edge_edge, self.measure]
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

    def begin_step(self, x: wp.array, friction: bool = True) -> None:
        """Freeze the contacts at x, which the last search must cover, for this step's friction."""
        self._list_active(x)
        if not friction:
            self.num_friction = 0

    def end_step(self, x: wp.array, start: wp.array) -> None:
        """Remember what friction holds at x, the end of a step that began at `start`."""
        self._bristle_total.zero_()
        self._bristle_weight.zero_()
        totals = [self._bristle_total, self._bristle_weight]
        if self.num_friction:
            wp.launch(
                share_bristles, self.num_friction, [x, start, self.friction, *totals], device=self.device
            )
        wp.launch(set_bristles, self.num_cloth, [*totals, self.friction.bristle], device=self.device)

    def turn_friction(self, turn: NDArray[np.float64]) -> None:
        """What friction holds turns with the world, by a rotation (3, 3)."""
        self.friction.bristle.assign(self.friction.bristle.numpy() @ turn.T)

    def forget_friction(self) -> None:
        """Friction lets go of what it holds."""
        self.friction.bristle.zero_()

    def near(self, x: wp.array, within: float) -> NDArray[np.bool_]:
        """Which vertices (V + N,) are of a pair less than `within` metres apart."""
        self._near.zero_()
        for pairs in self.lists:
            if pairs.length:
                args = [x, pairs.pairs, pairs.distance, pairs.is_edge_edge, within, self._near]
                wp.launch(mark_near, pairs.length, args, device=self.device)
        return self._near.numpy() > 0

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
                args = [x, x, pairs.pairs, pairs.distance, pairs.is_edge_edge, self.measure]
                args.append(self._friction_count)
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
