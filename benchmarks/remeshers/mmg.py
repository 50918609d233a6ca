"""MMG's two-dimensional remesher, boundary and all, with one edge length everywhere.

`hsiz` is the edge length; `hgrad` stays at its default. `hausd`, how far the boundary may come to lie from
the smooth curve that MMG sees in the source's, is 1 mm: MMG refines until that holds, and 0.1 mm gives coarse
panels half as many triangles again as were asked for. Corners, at which a seam or a hem ends, are required
vertices: MMG finds only those where the boundary turns.
"""

from __future__ import annotations

import mmgpy
import numpy as np
from numpy.typing import NDArray

from benchmarks.remeshers.exchange import Panel, contend, panel_by_panel

HAUSD = 1e-3
PACKAGES = ("mmgpy", "numpy")


def remesh_panel(panel: Panel, edge_length: float) -> tuple[NDArray[np.float64], NDArray[np.int32]]:
    """One panel, seams not heeded."""
    mesh = mmgpy.MmgMesh2D(panel.points, panel.faces)
    mesh.set_required_vertices(panel.corners)
    mesh.remesh(hsiz=edge_length, hausd=HAUSD, verbose=-1)
    return mesh.get_vertices(), mesh.get_triangles()


if __name__ == "__main__":
    contend(panel_by_panel(remesh_panel), PACKAGES, {"hsiz": "edge length", "hausd": HAUSD})
