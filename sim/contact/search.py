"""The lists of pairs that may come within range, and when they have to be looked for again."""

from __future__ import annotations

import numpy as np
import warp as wp
from numpy.typing import NDArray

from muslin.sim.cloth import ClothModel
from muslin.sim.contact.broad_phase import (
    Boxes,
    boxes_of_points,
    boxes_of_primitives,
    open_patches,
    renew_slack,
)
from muslin.sim.contact.narrow_phase import GroupPrimitives, find_near_edges, find_near_faces
from muslin.sim.contact.pair_list import PairList
from muslin.sim.contact.patch_motion import SetMotion, find_hot_pairs, split_motions
from muslin.sim.contact.patches import Patches, Rows, cut_cloth, cut_collider, joined

AHEAD = 0.005
"""Metres beyond the range within which patches are opened before they must be."""

MORE = 1.5
"""Growth of the pairs of groups since they were made anew from which on they are made anew."""


class _Sets:
    """Patches or groups: the vertices that their primitives touch, how these move, and the boxes of those
    that are wanted."""

    def __init__(self, touched: Rows, device: str) -> None:
        self.device = device
        self.count = len(touched.offsets) - 1
        self.rows = [_integers(touched.offsets, device), _integers(touched.rows, device)]
        self.wanted = wp.zeros(self.count, dtype=wp.int32, device=device)
        self.boxes = _boxes(self.count, device)
        self.motion = SetMotion()
        for name in ("centre", "mean", "spin"):
            setattr(self.motion, name, wp.zeros(self.count, dtype=wp.vec3d, device=device))
        for name in ("rest", "spread", "radius", "way"):
            setattr(self.motion, name, wp.zeros(self.count, dtype=wp.float64, device=device))
        self.motion.changed = wp.zeros(self.count, dtype=wp.int32, device=device)

    def forget(self) -> None:
        """The points may be elsewhere than where their motions were split last."""
        self.motion.radius.fill_(-1.0)

    def split_motions(self, *args: object) -> None:
        wp.launch(split_motions, self.count, [*self.rows, *args, self.motion], device=self.device)

    def bound(self, x: wp.array) -> None:
        wp.launch(boxes_of_points, self.count, [self.wanted, *self.rows, x, self.boxes], device=self.device)


class _SetPairs:
    """Pairs of patches or of groups: the slack of each, what the last move takes of it, and the hot ones.

    Slack is by how much the primitives of two sets that are not listed are at least further apart than the
    range. Hot are those that may use it up.
    """

    def __init__(self, pairs: NDArray[np.int32], device: str) -> None:
        self.device = device
        self.pairs = wp.array(pairs, dtype=wp.vec2i, device=device)
        capacity = len(pairs)
        self.slack = wp.full(capacity, -1.0, dtype=wp.float64, device=device)
        self.cost = wp.zeros(capacity, dtype=wp.float64, device=device)
        self.most = wp.zeros(capacity, dtype=wp.float64, device=device)
        self.hot = wp.zeros(capacity, dtype=wp.int32, device=device)
        self.hot_pairs = wp.zeros(capacity, dtype=wp.int32, device=device)
        self._num_hot = wp.zeros(1, dtype=wp.int32, device=device)

    def find_hot(self, count: int, sets: _Sets, spent: bool) -> int:
        """How many of the first `count` pairs are hot; their numbers stand in `hot_pairs`.

        The sets of those are `wanted`. `spent`: the move that was looked at last has been made.
        """
        self._num_hot.zero_()
        args = [self.pairs, sets.motion, spent, self.slack, self.cost, self.most, self.hot]
        args += [sets.wanted, self._num_hot, self.hot_pairs]
        wp.launch(find_hot_pairs, count, args, device=self.device)
        return int(self._num_hot.numpy()[0])


class PairSearch:
    """Vertex-face and edge-edge pairs within `range_` of each other, with at least one side on the cloth.

    Joint vertex array: V cloth vertices, then N of the collider, at `points` (V + N, 3) when patches are cut.
    Of every two patches, and of every two groups of patches near each other, it is known how far apart their
    unlisted primitives are at least; the motion of one relative to the other takes from that. Where it does
    not suffice, primitives are looked for again, `margin` further than they must.
    """

    def __init__(
        self,
        cloth: ClothModel,
        collider_faces: NDArray[np.int32],
        points: NDArray[np.float64],
        range_: float,
        margin: float,
        device: str,
        collider: Patches | None = None,
    ) -> None:
        """`collider`: its patches, if they are known."""
        self.device = device
        self.range = range_
        self.margin = margin
        n = cloth.num_vertices
        self.collider = cut_collider(points[n:], collider_faces) if collider is None else collider
        cut = joined(cut_cloth(points[:n], cloth), self.collider, n)
        self._patches = _Sets(cut.touched_by_patch, device)
        self._groups = _Sets(cut.touched_by_group, device)
        self._group_offsets = _integers(cut.groups, device)
        self._primitives = _primitives(cut, device)
        self._edge_boxes = _boxes(len(cut.edges.rows), device)
        self._face_boxes = _boxes(len(cut.faces.rows), device)
        upper = np.argwhere(np.tri(cut.num_cloth, cut.count, -1) == 0)
        self._patch_pairs = _SetPairs(upper.astype(np.int32), device)
        self._num_group_pairs = wp.zeros(1, dtype=wp.int32, device=device)
        self._reserve_groups(40 * self._groups.count)
        self._spent = False
        self._whole = wp.full(len(points), 1.0, dtype=wp.float64, device=device)
        self.still = wp.zeros(len(points), dtype=wp.vec3d, device=device)
        self.lists = [PairList(False, 8 * n, device), PairList(True, 16 * n, device)]

    def renew(self, x: wp.array) -> None:
        """Forget where things were, and list the pairs at x."""
        self._forget()
        self.cover(x, self.still)

    def spend(self) -> None:
        """The move that was covered last, or a part of it, has been made."""
        self._spent = True

    @property
    def most(self) -> wp.array:
        """What the two sides of a pair, by its owner, can at most come together by on the covered way, m."""
        return self._group_pairs.most

    def cover(self, x: wp.array, p: wp.array, fraction: wp.array | None = None) -> int:
        """Make sure that every pair that may come within range on the way from x to x + p is listed.

        With `fraction`, p is what was covered last but for the vertices that go only a fraction of their way.
        Returns how many pairs of groups were looked at anew.
        """
        again = fraction is not None
        for sets in (self._patches, self._groups):
            sets.split_motions(x, p, again, fraction if again else self._whole)
            sets.wanted.zero_()
        found = self._look(x, p) if self._open_patches(x) else None
        self._spent = False
        if found is None:
            self._forget()
            return self.cover(x, p)
        return found

    def _forget(self) -> None:
        """Leave nothing listed, and nothing known of how far apart things are."""
        self._spent = False
        self._patches.forget()
        self._groups.forget()
        self._patch_pairs.slack.fill_(-1.0)
        self._num_group_pairs.zero_()
        self.num_group_pairs = self._fewest = 0
        for pairs in self.lists:
            pairs.length = 0

    def _reserve_groups(self, capacity: int) -> None:
        self._group_pairs = _SetPairs(np.zeros((capacity, 2), np.int32), self.device)
        self.num_group_pairs = self._fewest = 0

    def _open_patches(self, x: wp.array) -> bool:
        """Pairs of groups for patches that come near each other; False if these have become too many."""
        patches, pairs, groups = self._patches, self._patch_pairs, self._group_pairs
        num_hot = pairs.find_hot(len(pairs.pairs), patches, self._spent)
        if num_hot == 0:
            return True
        patches.bound(x)
        args = [pairs.hot_pairs, pairs.pairs, patches.boxes, self._group_offsets, self.range, AHEAD]
        args += [pairs.slack, pairs.cost, self._num_group_pairs, groups.pairs, groups.slack]
        wp.launch(open_patches, num_hot, args, device=self.device)
        count = int(self._num_group_pairs.numpy()[0])
        if count > len(groups.slack):
            self._reserve_groups(count + count // 2)
            return False
        if self._fewest == 0:
            self._fewest = count
        self.num_group_pairs = count
        return count <= MORE * self._fewest

    def _look(self, x: wp.array, p: wp.array) -> int | None:
        """List the primitives of hot groups anew; None if there were too many of them."""
        groups, pairs = self._groups, self._group_pairs
        num_hot = pairs.find_hot(self.num_group_pairs, groups, self._spent)
        if num_hot == 0:
            return 0
        groups.bound(x)
        made = self._primitives
        for offsets, rows, boxes in (
            (made.edge_offsets, made.edges, self._edge_boxes),
            (made.face_offsets, made.faces, self._face_boxes),
        ):
            args = [groups.wanted, offsets, rows, x, boxes]
            wp.launch(boxes_of_primitives, groups.count, args, device=self.device)
        for listed in self.lists:
            listed.drop_hot(pairs.hot)
        near, crossing = self.lists
        for kernel, count, boxes, listed in (
            (find_near_faces, 2 * num_hot, self._face_boxes, near),
            (find_near_edges, num_hot, self._edge_boxes, crossing),
        ):
            args = [pairs.hot_pairs, pairs.pairs, made, groups.boxes, boxes, x, p]
            args += [self.range + self.margin, pairs.cost, listed.found]
            wp.launch(kernel, count, args, device=self.device)
        args = [pairs.hot_pairs, pairs.pairs, groups.boxes, self.range, self.margin]
        wp.launch(renew_slack, num_hot, [*args, pairs.slack, pairs.cost], device=self.device)
        enough = True
        for listed in self.lists:
            listed.length = int(listed.count.numpy()[0])
            if listed.length > len(listed.pairs):
                listed.reserve(listed.length + listed.length // 2)
                enough = False
        return num_hot if enough else None


def _integers(values: NDArray[np.int32], device: str) -> wp.array:
    return wp.array(values, dtype=wp.int32, ndim=values.ndim, device=device)


def _boxes(count: int, device: str) -> Boxes:
    boxes = Boxes()
    boxes.low = wp.zeros(count, dtype=wp.vec3d, device=device)
    boxes.high = wp.zeros(count, dtype=wp.vec3d, device=device)
    return boxes


def _primitives(cut: Patches, device: str) -> GroupPrimitives:
    made = GroupPrimitives()
    made.vertex_offsets = _integers(cut.vertices.offsets, device)
    made.vertices = _integers(cut.vertices.rows, device)
    made.edge_offsets = _integers(cut.edges.offsets, device)
    made.edges = _integers(cut.edges.rows, device)
    made.face_offsets = _integers(cut.faces.offsets, device)
    made.faces = _integers(cut.faces.rows, device)
    return made
