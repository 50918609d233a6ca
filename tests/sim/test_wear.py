"""Following a body: what cannot be done leaves garment and body as they were."""

from dataclasses import replace

import numpy as np
import pytest

from muslin.garments import catalogue
from muslin.garments.triangulate import triangulate
from muslin.sim.body import load_body
from muslin.sim.cloth import build_cloth
from muslin.sim.contact.system import ContactSettings
from muslin.sim.material import load_fabric
from muslin.sim.solve.errors import SimulationError
from muslin.sim.solve.settings import SolverSettings
from muslin.sim.wear import WornGarment


@pytest.fixture
def worn():
    design = catalogue.get("tee")
    mesh = triangulate(design.pattern(**design.preset("tshirt")), 0.06)
    cloth = build_cloth(mesh, load_fabric("gray-interlock"))
    worn = WornGarment(
        [mesh], [cloth], load_body("female"), np.zeros(2), ContactSettings(), SolverSettings(), "cpu"
    )
    worn.sim.settings = replace(worn.sim.settings, max_splits=0, max_advances=4)
    return worn


def test_a_body_that_cannot_go_on_stays_where_it_was(worn):
    """The cloth is pinned as a whole, and the body is to leave through it."""
    worn.sim.pins[:] = True
    cloth, collider = worn.sim.positions, worn.sim.collider_vertices
    with pytest.raises(SimulationError, match="cannot go on"):
        worn.follow(worn.theta, np.array([0.0, 0.0, 0.3]), 1.0 / 30.0)
    assert worn.sim.positions.tobytes() == cloth.tobytes()
    assert worn.sim.collider_vertices.tobytes() == collider.tobytes()
    assert (worn.translation == 0.0).all()
