"""Pairs of primitives on a device, with lower bounds of their distances."""

from __future__ import annotations

import warp as wp

from muslin.sim.contact.narrow_phase import FoundPairs, keep_cold_pairs


class PairList:
    """Growing list of vertex quadruples; the length is known on the host after a search.

    `distance`: a lower bound of each pair's distance, metres, exact where it is less than the contact range;
    `trial`: the same for a trial position.
    """

    def __init__(self, is_edge_edge: bool, capacity: int, device: str) -> None:
        self.is_edge_edge = is_edge_edge
        self.device = device
        self.count = wp.zeros(1, dtype=wp.int32, device=device)
        self.reserve(capacity)

    def reserve(self, capacity: int) -> None:
        """Make room for so many pairs; those listed are lost."""
        self._here, self._kept = self._room(capacity), self._room(capacity)
        self.trial = wp.zeros(capacity, dtype=wp.float64, device=self.device)
        self.length = 0

    @property
    def pairs(self) -> wp.array:
        return self._here.pairs

    @property
    def distance(self) -> wp.array:
        return self._here.distance

    @property
    def owner(self) -> wp.array:
        return self._here.owner

    @property
    def found(self) -> FoundPairs:
        """Where a search appends."""
        return self._here

    def drop_hot(self, hot: wp.array) -> None:
        """Leave out the pairs whose groups are hot."""
        self.count.zero_()
        if self.length:
            args = [self.pairs, self._here.owner, self.distance, hot, self._kept]
            wp.launch(keep_cold_pairs, self.length, args, device=self.device)
            self._here, self._kept = self._kept, self._here

    def accept_trial(self) -> None:
        """The trial position is where things are now."""
        self._here.distance, self.trial = self.trial, self._here.distance

    def _room(self, capacity: int) -> FoundPairs:
        room = FoundPairs()
        room.pairs = wp.zeros(capacity, dtype=wp.vec4i, device=self.device)
        room.owner = wp.zeros(capacity, dtype=wp.int32, device=self.device)
        room.distance = wp.zeros(capacity, dtype=wp.float64, device=self.device)
        room.count = self.count
        return room
