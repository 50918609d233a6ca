"""MMG's two-dimensional remesher with the source's boundary kept (`nosurf`), so that seams stay matched.

Edges inside have one length, `hsiz`. `hgrad` and `hgradreq` at 1.3 would grade from the boundary's lengths to
it: fewer angles below 30 degrees where these differ (0.1% and not 0.6% of them, from 17,246 vertices to
3,600), but areas that spread further (a coefficient of variation of 0.46 and not 0.37).
"""

from __future__ import annotations

import mmgpy
import numpy as np
from numpy.typing import NDArray

from benchmarks.remeshers.exchange import Panel, contend, panel_by_panel
from benchmarks.remeshers.mmg import PACKAGES


def remesh_panel(panel: Panel, edge_length: float) -> tuple[NDArray[np.float64], NDArray[np.int32]]:
    """One panel, its boundary vertices and edges as they are."""
    mesh = mmgpy.MmgMesh2D(panel.points, panel.faces)
    mesh.remesh(hsiz=edge_length, nosurf=1, verbose=-1)
    return mesh.get_vertices(), mesh.get_triangles()


if __name__ == "__main__":
    contend(panel_by_panel(remesh_panel), PACKAGES, {"hsiz": "edge length", "nosurf": 1})
