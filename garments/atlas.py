"""The uv atlas: panels of one pattern side by side in the unit square."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from muslin.garments.layout import arrange
from muslin.garments.pattern import Pattern

GAP = 0.05  # metres between panels: some four texels of a 128 x 128 map of a tee
MARGIN = 0.02  # of the unit square, on every side


@dataclass(frozen=True, eq=False)
class Atlas:
    """Maps panel space to uv by one scale for all panels and one offset a panel.

    uv = scale * (x + offset[panel]), with scale in 1 / metres and offset (panels, 2) in metres.
    """

    scale: float
    offsets: NDArray[np.float64]

    @staticmethod
    def of(pattern: Pattern) -> Atlas:
        """The atlas of the pattern's own panels, grain along v."""
        outlines = [panel.outline() for panel in pattern.panels]
        corners, size = arrange([np.ptp(outline, axis=0) for outline in outlines], GAP)
        scale = (1.0 - 2.0 * MARGIN) / float(size.max())
        low = np.array([outline.min(axis=0) for outline in outlines])
        return Atlas(scale, corners - low + MARGIN / scale)

    def place(self, points: NDArray[np.float64], panel: int) -> NDArray[np.float64]:
        """uv (N, 2) of points (N, 2), metres, of one panel."""
        return self.scale * (points + self.offsets[panel])
