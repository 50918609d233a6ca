"""The solver of the GPU against that of the CPU: same directions, same drape."""

from collections.abc import Callable

import numpy as np
import pytest
import trimesh
from numpy.typing import NDArray

from muslin.garments.mesh import GarmentMesh
from muslin.sim.cloth import build_cloth
from muslin.sim.material import load_fabric
from muslin.sim.solve.settings import SolverSettings
from muslin.sim.solve.simulator import ClothSimulator

GridMesh = Callable[[int, int, float], GarmentMesh]


def over_sphere(mesh: GarmentMesh, device: str) -> ClothSimulator:
    """A square sheet 5 mm above a sphere of 10 cm radius."""
    sphere = trimesh.creation.icosphere(subdivisions=3, radius=0.1)
    flat = mesh.panel_vertices - mesh.panel_vertices.mean(axis=0)
    positions = np.stack([flat[:, 0], np.full(len(flat), 0.105), -flat[:, 1]], axis=1)
    cloth = build_cloth(mesh, load_fabric("gray-interlock"))
    faces = np.asarray(sphere.faces, dtype=np.int32)
    # Solved to the end, every step has one minimiser; cut short, it depends on the way there.
    tight = SolverSettings(
        tolerance=1e-8, max_iterations=100, linear_tolerance=1e-6, max_linear_iterations=2000
    )
    return ClothSimulator(cloth, positions, np.asarray(sphere.vertices), faces, solver=tight, device=device)


def fallen(sim: ClothSimulator, steps: int) -> NDArray[np.float64]:
    for _ in range(steps):
        sim.advance(None, 1.0 / 60.0)
    return sim.positions


def test_both_solvers_find_the_same_direction(grid_mesh: GridMesh) -> None:
    sim = over_sphere(grid_mesh(12, 12, 0.03), "cpu")
    fallen(sim, 8)
    x = sim.x.numpy()
    x[: sim.cloth.num_vertices, 1] += 1e-4 * (1.0 + np.sin(np.arange(sim.cloth.num_vertices)))
    sim.restore(x, sim.velocity)
    sim._assemble(60.0)
    directions = []
    for parallel in (False, True):
        sim.linear.parallel = parallel
        sim.linear.solve(sim.gradient, sim.remaining, sim.p, 1e-12, 2000)
        directions.append(sim.p.numpy()[: sim.cloth.num_vertices].copy())
    assert np.abs(directions[0]).max() > 1e-7
    np.testing.assert_allclose(directions[1], directions[0], atol=1e-6 * np.abs(directions[0]).max())


def test_falling_does_not_depend_on_the_linear_solver(grid_mesh: GridMesh) -> None:
    drapes = []
    for parallel in (False, True):
        sim = over_sphere(grid_mesh(10, 10, 0.03), "cpu")
        sim.linear.parallel = parallel
        drapes.append(fallen(sim, 8))
    assert np.linalg.norm(drapes[0] - drapes[1], axis=1).max() < 1e-5


@pytest.mark.gpu
def test_the_gpu_agrees_with_the_cpu(grid_mesh: GridMesh) -> None:
    mesh = grid_mesh(16, 16, 0.02)
    drapes = [fallen(over_sphere(mesh, device), 8) for device in ("cpu", "cuda:0")]
    assert np.linalg.norm(drapes[0] - drapes[1], axis=1).max() < 1e-5
