"""Time stepping against closed forms: free fall, momentum, a hanging strip, symmetry, energy, order in dt."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
import warp as wp
from numpy.typing import NDArray

from muslin.garments.mesh import GarmentMesh
from muslin.sim.cloth import build_cloth
from muslin.sim.material import Fabric, isotropic_fabric, load_fabric
from muslin.sim.solve.rest_forces import force_residual, pin_forces
from muslin.sim.solve.settings import SolverSettings
from muslin.sim.solve.simulator import ClothSimulator

Array = NDArray[np.float64]
GridMesh = Callable[[int, int, float], GarmentMesh]

JERSEY = load_fabric("gray-interlock")
RUBBER = isotropic_fabric(young=4.0e5, poisson=0.0, thickness=2.0e-4, density=0.25)

EXACT = SolverSettings(
    tolerance=1e-11, min_iterations=2, max_iterations=60, linear_tolerance=1e-8, max_linear_iterations=2000
)
"""Every step solved as far as double precision goes."""


def simulator(mesh: GarmentMesh, fabric: Fabric, x: Array, settings: SolverSettings) -> ClothSimulator:
    """Cloth alone, without a collider."""
    return ClothSimulator(
        build_cloth(mesh, fabric), x, np.zeros((0, 3)), np.zeros((0, 3), np.int32), solver=settings
    )


def hung(mesh: GarmentMesh) -> Array:
    """The panel as it is, in the plane z = 0."""
    return np.insert(mesh.panel_vertices, 2, 0.0, axis=1)


def elastic_energy(sim: ClothSimulator) -> float:
    out = wp.zeros(1, dtype=wp.float64)
    sim.elastic.add_value(sim.x, 0.0, out)
    return float(out.numpy()[0])


def kinetic_energy(sim: ClothSimulator) -> float:
    return float(0.5 * sim.cloth.mass @ (sim.velocity**2).sum(axis=1))


@pytest.mark.parametrize("drag", [0.0, 0.5, 20.0])
@pytest.mark.parametrize("dt", [1.0 / 120.0, 1.0 / 30.0])
def test_free_fall_is_implicit_euler(sheet_mesh: GarmentMesh, drag: float, dt: float) -> None:
    """v' = (v + g dt) / (1 + a dt), x' = x + dt v': in n steps v = q^n v0 + g dt (q + ... + q^n)."""
    settings = replace(EXACT, drag=drag)
    x0, v0 = hung(sheet_mesh), np.array([0.3, 1.0, -0.2])
    sim = simulator(sheet_mesh, JERSEY, x0, settings)
    sim.velocity[:] = v0
    q, n = 1.0 / (1.0 + drag * dt), 10
    gravity = np.array(settings.gravity)
    for _ in range(n):
        sim.advance(None, dt)
    velocities = [q**k * v0 + gravity * dt * sum(q**j for j in range(1, k + 1)) for k in range(1, n + 1)]
    np.testing.assert_allclose(sim.velocity, np.tile(velocities[-1], (len(x0), 1)), atol=1e-8)
    np.testing.assert_allclose(sim.positions, x0 + dt * sum(velocities), atol=1e-10)


def test_without_gravity_momentum_stays(sheet_mesh: GarmentMesh) -> None:
    settings = replace(EXACT, gravity=(0.0, 0.0, 0.0), drag=0.0)
    sim = simulator(sheet_mesh, JERSEY, hung(sheet_mesh), settings)
    sim.velocity[:] = np.random.default_rng(2).normal(size=sim.velocity.shape)
    mass = sim.cloth.mass
    momentum = mass @ sim.velocity
    scale = mass.sum() * np.abs(sim.velocity).max()
    centre = mass @ sim.positions / mass.sum()
    dt, n = 0.005, 12
    for _ in range(n):
        sim.advance(None, dt)
    np.testing.assert_allclose(mass @ sim.velocity, momentum, atol=1e-8 * scale)
    expected = centre + n * dt * momentum / mass.sum()
    np.testing.assert_allclose(mass @ sim.positions / mass.sum(), expected, atol=1e-9)


def test_undriven_cloth_never_gains_energy(sheet_mesh: GarmentMesh) -> None:
    settings = replace(EXACT, gravity=(0.0, 0.0, 0.0), drag=0.0)
    sim = simulator(sheet_mesh, JERSEY, hung(sheet_mesh), settings)
    sim.velocity[:] = np.random.default_rng(3).normal(size=sim.velocity.shape)
    centre = sim.cloth.mass @ sim.velocity / sim.cloth.mass.sum()
    rigid = 0.5 * sim.cloth.mass.sum() * centre @ centre
    energies = [kinetic_energy(sim)]
    for _ in range(40):
        sim.advance(None, 0.01)
        energies.append(kinetic_energy(sim) + elastic_energy(sim))
    assert (np.diff(energies) <= 1e-9 * energies[0]).all()
    assert rigid < energies[-1] < 0.2 * energies[0]


def test_strip_hangs_stretched_by_its_own_weight(grid_mesh: GridMesh) -> None:
    """c11 (lambda^3 - lambda) = rho g s with s the length of strip below; the elongation is its integral."""
    nx, ny, side = 2, 20, 0.025
    mesh = grid_mesh(nx, ny, side)
    sim = simulator(mesh, RUBBER, hung(mesh), replace(EXACT, tolerance=1e-9))
    rest = sim.positions
    top = rest[:, 1] > -1e-9
    sim.pins[top] = True
    for _ in range(12):
        sim.advance(None, 0.3, inertia=False, pin_targets=rest)
    x = sim.positions
    length = ny * side
    load = 0.25 * 9.81 * (np.arange(2000) + 0.5) / 2000 * length
    c11 = RUBBER.stretch_rest[0]
    stretches = [max(np.roots([1.0, 0.0, -1.0, -s / c11]).real) for s in load]
    elongation = length * (np.mean(stretches) - 1.0)
    assert elongation > 3e-3
    bottom = rest[:, 1] < -length + 1e-9
    np.testing.assert_allclose((rest - x)[bottom, 1], elongation, rtol=0.01)
    np.testing.assert_array_equal(x[top], rest[top])
    held = pin_forces(sim, 0.3).sum(axis=0)
    np.testing.assert_allclose(held, [0.0, sim.cloth.mass.sum() * 9.81, 0.0], atol=1e-4 * held[1])


def test_pins_take_the_cloth_where_they_are_told(grid_mesh: GridMesh) -> None:
    """A sheet held by two corners follows them exactly, however far they go in a step; then it is let go."""
    mesh = grid_mesh(6, 6, 0.03)
    x = hung(mesh)
    sim = simulator(mesh, JERSEY, x, SolverSettings())
    top = x[:, 1] > -1e-9
    held = top & ((x[:, 0] < x[:, 0].min() + 1e-9) | (x[:, 0] > x[:, 0].max() - 1e-9))
    sim.pins[held] = True
    told = x.copy()
    for _ in range(10):
        told = told + np.array([0.05, 0.02, -0.03])
        sim.advance(None, 1.0 / 60.0, pin_targets=told)
        np.testing.assert_allclose(sim.positions[held], told[held], atol=1e-14)
    np.testing.assert_allclose(sim.velocity[held], np.tile([3.0, 1.2, -1.8], (2, 1)))
    assert np.linalg.norm(sim.positions[~held] - x[~held], axis=1).min() > 0.1
    sim.pins[:] = False
    sim.set_gravity((0.0, 0.0, 0.0))
    before = sim.cloth.mass @ sim.velocity
    sim.settings = EXACT
    sim.advance(None, 1.0 / 60.0)
    drag = 1.0 + EXACT.drag / 60.0
    np.testing.assert_allclose(sim.cloth.mass @ sim.velocity, before / drag, rtol=1e-9)


def test_mirrored_cloth_moves_as_the_mirror_image(grid_mesh: GridMesh) -> None:
    mesh = grid_mesh(4, 5, 0.04)
    mirror = np.array([-1.0, 1.0])
    faces = mesh.faces[:, [0, 2, 1]]
    mirrored = replace(mesh, panel_vertices=mesh.panel_vertices * mirror, faces=faces, panel_faces=faces)
    results = []
    for garment, sign in ((mesh, 1.0), (mirrored, -1.0)):
        x = hung(mesh)
        x[:, 2] = 0.02 * np.sin(20.0 * x[:, 0]) * np.cos(15.0 * x[:, 1])
        x[:, 0] *= sign
        sim = simulator(garment, JERSEY, x, EXACT)
        # Held at one corner, so that it turns to one side.
        sim.pins[mesh.panel_vertices.sum(axis=1).argmax()] = True
        for _ in range(12):
            sim.advance(None, 0.01, pin_targets=x)
        results.append(sim.positions * [sign, 1.0, 1.0])
    assert np.abs(results[0] - hung(mesh)).max() > 0.02
    np.testing.assert_allclose(results[1], results[0], atol=1e-7)


def swing(mesh: GarmentMesh, dt: float, duration: float) -> Array:
    """A strip let go level from its pinned edge."""
    x = hung(mesh)
    x[:, [1, 2]] = x[:, [2, 1]]
    sim = simulator(mesh, RUBBER.scaled(stretch=4.0), x, replace(EXACT, tolerance=1e-9, damping=0.01))
    sim.pins[x[:, 2] > -1e-9] = True
    for _ in range(round(duration / dt)):
        sim.advance(None, dt, pin_targets=x)
    return sim.positions


def test_swing_converges_at_first_order_in_the_time_step(grid_mesh: GridMesh) -> None:
    mesh = grid_mesh(1, 5, 0.05)
    ends = [swing(mesh, dt, 0.16) for dt in (0.008, 0.004, 0.002, 0.001)]
    assert np.abs(ends[-1] - hung(mesh)).max() > 0.1
    errors = [np.linalg.norm(b - a) for a, b in pairwise(ends)]
    orders = np.log2(np.array(errors[:-1]) / errors[1:])
    assert (orders > 0.8).all()
    assert (orders < 1.2).all()


def test_cloth_at_rest_stays_and_free_fall_leaves_all_the_weight(sheet_mesh: GarmentMesh) -> None:
    sim = simulator(sheet_mesh, JERSEY, hung(sheet_mesh), replace(EXACT, gravity=(0.0, 0.0, 0.0)))
    report = sim.advance(None, 0.01)
    assert report.converged
    np.testing.assert_allclose(sim.positions, hung(sheet_mesh), atol=1e-12)
    # In free fall all the weight is left over.
    share = np.linalg.norm(sim.cloth.mass) / sim.cloth.mass.sum()
    falling = simulator(sheet_mesh, JERSEY, hung(sheet_mesh), EXACT)
    assert force_residual(falling, 0.01) == pytest.approx(share, rel=1e-9)


def test_restored_state_repeats_bit_for_bit(sheet_mesh: GarmentMesh) -> None:
    sim = simulator(sheet_mesh, JERSEY, hung(sheet_mesh), SolverSettings())
    sim.velocity[:] = np.random.default_rng(4).normal(size=sim.velocity.shape)
    sim.advance(None, 0.01)
    saved_x, saved_v, shift = sim.x.numpy().copy(), sim.velocity.copy(), sim.linear.shift
    sim.advance(None, 0.01)
    first = sim.positions
    sim.restore(saved_x, saved_v)
    sim.linear.shift = shift
    sim.advance(None, 0.01)
    np.testing.assert_array_equal(sim.positions, first)
