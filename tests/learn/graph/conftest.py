import numpy as np
import pytest

from muslin.garments.mesh import GarmentMesh
from muslin.garments.template import template


@pytest.fixture(scope="session")
def garment() -> GarmentMesh:
    return template("tee", resolution=1400)


@pytest.fixture(scope="session")
def worn(garment: GarmentMesh) -> np.ndarray:
    """Its panels side by side as a surface in space: every sewn vertex somewhere, no two in one place."""
    points = np.zeros((garment.num_vertices, 3))
    points[garment.panel_to_vertex, :2] = garment.panel_vertices
    points[garment.panel_to_vertex, 2] = 0.2 * garment.panel_vertex_panel
    return points
