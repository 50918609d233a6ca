"""A budget of Newton iterations that every step has anew."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from muslin.garments.mesh import GarmentMesh
from muslin.sim.budget import with_budget
from muslin.sim.cloth import build_cloth
from muslin.sim.contact.system import ContactSettings
from muslin.sim.material import load_fabric
from muslin.sim.solve.errors import SimulationError
from muslin.sim.solve.settings import SolverSettings
from muslin.sim.solve.simulator import ClothSimulator


def test_every_step_has_the_whole_budget(grid_mesh: Callable[[int, int, float], GarmentMesh]) -> None:
    mesh = grid_mesh(2, 2, 0.05)
    nothing = np.zeros((0, 3)), np.zeros((0, 3), np.int32)
    cloth = build_cloth(mesh, load_fabric("gray-interlock"))
    flat = np.pad(mesh.panel_vertices, ((0, 0), (0, 1)))
    sim = ClothSimulator(cloth, flat, *nothing, ContactSettings(), SolverSettings())
    ticks: list[int] = []
    next_step = with_budget(sim, 6, lambda: ticks.append(1))
    for _ in range(3):
        assert sim.work_left == 6
        sim.advance(None, 0.02)
        assert sim.work_left < 6
        next_step()
    assert len(ticks) == 3
    with_budget(sim, 0, lambda: None)
    with pytest.raises(SimulationError, match="max_work"):
        sim.advance(None, 0.02)
