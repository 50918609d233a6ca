"""Positions of the same points of cloth in tracks of different topology, and at different times."""

from __future__ import annotations

import numpy as np

from muslin.eval.read.track import Track
from muslin.garments.correspondence import Correspondence, correspondence
from muslin.garments.errors import InputError


class MaterialPoints:
    """Looks up positions of a track at the vertices of another mesh; remembers which points belong together.

    Meshes of the same triangles, in any order, correspond vertex for vertex. Others do by panel space, if
    their panels are known and of one pattern (`correspondence`). Else they do not: equal numbers of vertices
    are no proof that vertex k is the same point on both sides, so `vertices_correspond` has to say that.
    """

    def __init__(self, vertices_correspond: bool = False) -> None:
        self._vertices_correspond = vertices_correspond
        self._same: dict[tuple[int, int], bool] = {}
        self._known: dict[tuple[int, int], Correspondence] = {}
        self.by_panel_space = False

    def carried(
        self, x: np.ndarray, track: Track, frame: int, target: Track, target_frame: int, count: int
    ) -> np.ndarray:
        """Positions x (V', 3) of `track` in `frame`, at the points that the `count` vertices of `target` are
        in `target_frame`.

        (count, 3), metres. Raises InputError if the points do not correspond.
        """
        faces = track.faces[frame]
        same_count = len(x) == count
        if same_count and (
            self._vertices_correspond or self._same_triangles(faces, target.faces[target_frame])
        ):
            return x
        if not (track.garments and target.garments):
            remedy = (
                "; vertex counts agree: if vertex k is the same point on both sides, say so with "
                "--vertices-correspond"
            )
            raise InputError(
                "the meshes differ in topology, and of one or both no panels are known"
                + (remedy if same_count else "")
            )
        source, onto = track.garments[frame], target.garments[target_frame]
        key = id(source), id(onto)
        if key not in self._known:
            self._known[key] = correspondence(source, onto)
        self.by_panel_space = True
        return self._known[key].carry(x)

    def _same_triangles(self, a: np.ndarray, b: np.ndarray) -> bool:
        key = id(a), id(b)
        if key not in self._same:
            self._same[key] = np.array_equal(a, b) or (
                a.shape == b.shape and np.array_equal(_in_order(a), _in_order(b))
            )
        return self._same[key]


def _in_order(faces: np.ndarray) -> np.ndarray:
    """The triangles as sets of vertices, sorted."""
    corners = np.sort(faces, axis=1)
    return corners[np.lexsort(corners.T[::-1])]
