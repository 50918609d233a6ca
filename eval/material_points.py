"""Positions of the same points of cloth in tracks of different topology, and at different times."""

from __future__ import annotations

import numpy as np

from muslin.eval.subjects import Track
from muslin.garments.correspondence import Correspondence, correspondence
from muslin.garments.errors import InputError


class MaterialPoints:
    """Looks up positions of a track at the vertices of another mesh; remembers which points belong together.

    Equal faces correspond vertex for vertex. Other meshes do by panel space, if their panels are known and of
    one pattern (`correspondence`).
    """

    def __init__(self) -> None:
        self._known: dict[tuple[int, int], Correspondence] = {}
        self.by_panel_space = False

    def positions(self, track: Track, frame: int, target: Track, target_frame: int) -> np.ndarray:
        """Where in `frame` of `track` the points lie that `target`'s vertices are in `target_frame`.

        (V, 3), metres, V of the target. Raises InputError if the points do not correspond.
        """
        x, faces = track.positions[frame], track.faces[frame]
        same_count = len(x) == len(target.positions[target_frame])
        if same_count and np.array_equal(faces, target.faces[target_frame]):
            return x
        if not (track.garments and target.garments):
            raise InputError("the meshes differ in topology, and of one or both no panels are known")
        source, onto = track.garments[frame], target.garments[target_frame]
        key = id(source), id(onto)
        if key not in self._known:
            self._known[key] = correspondence(source, onto)
        self.by_panel_space = True
        return self._known[key].carry(x)
