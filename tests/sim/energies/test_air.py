"""Air: exact derivatives, and cloth in it against closed forms."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
import warp as wp
from numpy.typing import NDArray
from scipy.optimize import brentq

from muslin.garments.mesh import GarmentMesh
from muslin.sim.air import AirDrag, AirSettings
from muslin.sim.cloth import build_cloth
from muslin.sim.material import isotropic_fabric
from muslin.sim.solve.linear import LinearSystem
from muslin.sim.solve.settings import SolverSettings
from muslin.sim.solve.simulator import ClothSimulator
from tests.sim.dense import dense

Array = NDArray[np.float64]
GridMesh = Callable[[int, int, float], GarmentMesh]

STIFF = isotropic_fabric(young=5.0e7, poisson=0.0, thickness=1.0e-3, density=0.2)
SOFT = isotropic_fabric(young=1.0e6, poisson=0.3, thickness=4.0e-4, density=0.2)
DT = 0.01


class Blown:
    """The energy of the air alone, of a small sheet in arbitrary motion."""

    def __init__(self, mesh: GarmentMesh) -> None:
        rng = np.random.default_rng(4)
        cloth = build_cloth(mesh, SOFT)
        self.cloth = cloth
        self.start = np.insert(mesh.panel_vertices, 2, 0.0, axis=1)
        self.start += 0.02 * rng.normal(size=self.start.shape)
        self.velocity = rng.normal(size=self.start.shape)
        self.air = AirDrag(cloth, AirSettings(wind=(1.0, -0.4, 2.0), along=0.3), "cpu")
        self.linear = LinearSystem(cloth, "cpu")
        self._start = wp.array(self.start, dtype=wp.vec3d)
        self.air.begin_step(self._start, self.velocity)

    def energy(self, x: Array) -> float:
        out = wp.zeros(1, dtype=wp.float64)
        self.air.add_value(wp.array(x, dtype=wp.vec3d), self._start, 1.0 / DT, out)
        return float(out.numpy()[0])

    def derivatives(self, x: Array) -> tuple[Array, Array]:
        """Gradient (V, 3) and dense Hessian (3 V, 3 V)."""
        gradient = wp.zeros(len(x), dtype=wp.vec3d)
        self.linear.clear()
        matrix = self.linear.matrix
        self.air.add_derivatives(wp.array(x, dtype=wp.vec3d), self._start, 1.0 / DT, gradient, matrix)
        return gradient.numpy(), dense(matrix)


@pytest.fixture
def blown(sheet_mesh: GarmentMesh) -> Blown:
    return Blown(sheet_mesh)


def test_the_force_is_the_gradient_of_the_energy(blown: Blown) -> None:
    x = blown.start + DT * np.random.default_rng(5).normal(size=blown.start.shape)
    gradient, _ = blown.derivatives(x)
    h = 1e-6
    for index in np.ndindex(4, 3):
        step = np.zeros_like(x)
        step[index] = h
        difference = (blown.energy(x + step) - blown.energy(x - step)) / (2.0 * h)
        assert gradient[index] == pytest.approx(difference, rel=1e-6, abs=1e-9)


def test_the_hessian_is_that_of_the_energy_and_positive(blown: Blown) -> None:
    rng = np.random.default_rng(6)
    x, step = blown.start, rng.normal(size=blown.start.shape)
    gradient, hessian = blown.derivatives(x)
    # The energy is quadratic: its gradient changes by the Hessian over any distance.
    np.testing.assert_allclose(
        (blown.derivatives(x + step)[0] - gradient).ravel(), hessian @ step.ravel(), atol=1e-9
    )
    eigenvalues = np.linalg.eigvalsh(hessian)
    assert eigenvalues.min() > -1e-9 * eigenvalues.max()


def test_the_force_at_the_start_is_the_drag_of_plates(blown: Blown) -> None:
    """As the step's start goes on: -1/2 rho A (C_n |v.n| (v.n) n + C_t |v_t| v_t), a third a corner."""
    settings = AirSettings(wind=(1.0, -0.4, 2.0), along=0.3)
    expected = np.zeros_like(blown.start)
    for face in blown.cloth.faces:
        a, b, c = blown.start[face]
        double = np.cross(b - a, c - a)
        area, n = 0.5 * np.linalg.norm(double), double / np.linalg.norm(double)
        v = blown.velocity[face].mean(axis=0) - np.array(settings.wind)
        tangent = v - (v @ n) * n
        drag = settings.across * abs(v @ n) * (v @ n) * n
        drag += settings.along * np.linalg.norm(tangent) * tangent
        expected[face] += 0.5 * settings.density * area * drag / 3.0
    gradient, _ = blown.derivatives(blown.start + DT * blown.velocity)
    np.testing.assert_allclose(gradient, expected, atol=1e-12)


def simulator(mesh: GarmentMesh, x: Array, air: AirSettings, drag: float = 0.0) -> ClothSimulator:
    settings = SolverSettings(drag=drag, damping=0.0, tolerance=1e-7, max_iterations=20, air=air)
    return ClothSimulator(
        build_cloth(mesh, STIFF), x, np.zeros((0, 3)), np.zeros((0, 3), np.int32), solver=settings
    )


def test_a_falling_sheet_approaches_its_terminal_velocity(grid_mesh: GridMesh) -> None:
    """v = v_inf tanh(g t / v_inf), v_inf = sqrt(2 sigma g / (rho C)).

    |v_n| v_(n+1) in place of v^2 is Kahan's discretisation of this equation: of second order in dt.
    """
    mesh, air = grid_mesh(3, 3, 0.1), AirSettings()
    flat = np.insert(mesh.panel_vertices, 1, 0.0, axis=1)
    limit = np.sqrt(2.0 * STIFF.density * 9.81 / (air.density * air.across))
    errors = []
    for steps in (20, 40):
        sim = simulator(mesh, flat, air)
        for _ in range(steps):
            sim.advance(None, 0.2 / steps)
        exact = limit * np.tanh(9.81 * 0.2 / limit)
        errors.append(abs(-sim.velocity[:, 1].mean() - exact) / exact)
    assert errors[0] < 1e-3
    assert errors[0] / errors[1] == pytest.approx(4.0, abs=0.4)
    for _ in range(100):
        sim.advance(None, 0.02)
    assert np.abs(sim.velocity[:, 1] + limit).max() < 1e-4 * limit


@pytest.mark.parametrize("speed", [1.0, 2.0, 4.0])
def test_a_hinged_plate_settles_at_the_angle_of_its_wind(grid_mesh: GridMesh, speed: float) -> None:
    """sigma g sin(phi) = 1/2 rho C_n w^2 cos^2(phi) for a sheet pinned along its top edge.

    The load is the same everywhere on the sheet, so that it stays flat whatever it is made of.
    """
    mesh, air = grid_mesh(4, 4, 0.05), AirSettings(wind=(0.0, 0.0, speed), along=0.0)
    sim = simulator(mesh, np.insert(mesh.panel_vertices, 2, 0.0, axis=1), air, drag=8.0)
    sim.pins = mesh.panel_vertices[:, 1] == 0.0
    for _ in range(120):
        sim.advance(None, 0.05)
    share = 0.5 * air.density * air.across * speed**2 / (STIFF.density * 9.81)
    exact = brentq(lambda angle: np.sin(angle) - share * np.cos(angle) ** 2, 0.0, np.pi / 2.0)
    lower = sim.positions[mesh.panel_vertices[:, 1] < 0.0]
    angles = np.arctan2(lower[:, 2], -lower[:, 1])
    np.testing.assert_allclose(angles, exact, atol=2e-3)


def test_a_sheet_along_the_wind_is_dragged_by_friction_alone(grid_mesh: GridMesh) -> None:
    """m dv/dt = 1/2 rho C_t A (w - v)^2, so w - v = w / (1 + k w t) with k = rho C_t / (2 sigma)."""
    air = AirSettings(wind=(10.0, 0.0, 0.0), along=0.5)
    mesh = grid_mesh(3, 3, 0.1)
    settings = SolverSettings(gravity=(0.0, 0.0, 0.0), drag=0.0, air=air, tolerance=1e-8, max_iterations=20)
    sim = ClothSimulator(
        build_cloth(mesh, STIFF),
        np.insert(mesh.panel_vertices, 2, 0.0, axis=1),
        np.zeros((0, 3)),
        np.zeros((0, 3), np.int32),
        solver=settings,
    )
    for _ in range(100):
        sim.advance(None, 0.002)
    k = air.density * air.along / (2.0 * STIFF.density)
    np.testing.assert_allclose(sim.velocity[:, 0], 10.0 - 10.0 / (1.0 + k * 10.0 * 0.2), rtol=0.01)
    assert np.abs(sim.velocity[:, 1:]).max() < 1e-6
