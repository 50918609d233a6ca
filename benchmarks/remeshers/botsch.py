"""gpytoolbox's `remesh_botsch` (Botsch and Kobbelt 2004) on panels lying in z = 0, boundary vertices kept.

Ten iterations, its default, with projection onto the source, which in the plane changes nothing but that
vertices stay in the panel.
"""

from __future__ import annotations

import gpytoolbox
import numpy as np
from numpy.typing import NDArray

from benchmarks.remeshers.exchange import Panel, contend, panel_by_panel

ITERATIONS = 10


def remesh_panel(panel: Panel, edge_length: float) -> tuple[NDArray[np.float64], NDArray[np.int32]]:
    """One panel, its boundary vertices as they are."""
    lifted = np.column_stack([panel.points, np.zeros(len(panel.points))])
    vertices, triangles = gpytoolbox.remesh_botsch(lifted, panel.faces, ITERATIONS, edge_length, True)
    return np.ascontiguousarray(vertices[:, :2]), triangles


if __name__ == "__main__":
    contend(panel_by_panel(remesh_panel), ("gpytoolbox", "numpy"), {"i": ITERATIONS, "project": True})
