"""Energies against closed forms, against the simulator's own, and least where the simulator comes to rest."""

from __future__ import annotations

import subprocess
import sys
from dataclasses import replace

import numpy as np
import pytest
import warp as wp

from muslin.eval.fabric_energy import Energy, FabricEnergy
from muslin.eval.metrics.checks import corner_areas
from muslin.eval.metrics.dihedral import dihedral_angles, hinges
from muslin.eval.metrics.strain import green_strain
from muslin.eval.validate.meshes import rectangle
from muslin.garments.errors import InputError
from muslin.garments.merge import merge_meshes
from muslin.sim.cloth import build_cloth
from muslin.sim.elastic import ElasticEnergy
from muslin.sim.energies.bending import bend_angle
from muslin.sim.material import isotropic_fabric, load_fabric
from muslin.sim.scene import parse_scene
from muslin.sim.solve.settings import SolverSettings
from muslin.sim.solve.simulator import ClothSimulator

JERSEY = load_fabric("gray-interlock")
PLATE = isotropic_fabric(young=2.0e6, poisson=0.3, thickness=4.0e-4, density=0.2)
MESH = rectangle(0.3, 0.2, 12, 8, "irregular")
FLAT = np.insert(MESH.panel_vertices, 1, 0.0, axis=1)  # level, at y = 0
METRE_UP = np.array([0.0, 1.0, 0.0])


def rolled(radius: float) -> np.ndarray:
    x, y = MESH.panel_vertices.T
    return np.stack([radius * np.sin(x / radius), y, radius * np.cos(x / radius)], axis=1)


def test_lifting_by_a_metre_costs_the_weight_and_nothing_else():
    ask = FabricEnergy(MESH, JERSEY)
    low, high = ask.energy(FLAT), ask.energy(FLAT + METRE_UP)
    assert high.gravity - low.gravity == pytest.approx(JERSEY.density * 0.06 * 9.81)
    assert (low.stretch, low.bending) == pytest.approx((0.0, 0.0), abs=1e-15)
    moon = FabricEnergy(MESH, JERSEY, (0.0, -1.62, 0.0)).energy(FLAT + METRE_UP)
    assert moon.gravity == pytest.approx(JERSEY.density * 0.06 * 1.62)


def test_even_stretch_has_the_energy_of_the_membrane():
    E11, E22 = (1.1**2 - 1) / 2, (0.95**2 - 1) / 2
    c11, c12, c22, _ = PLATE.stretch_rest
    found = FabricEnergy(MESH, PLATE).energy(FLAT * [0.95, 1.0, 1.1])
    assert found.stretch == pytest.approx(0.06 * (c11 * E11**2 + 2 * c12 * E11 * E22 + c22 * E22**2))
    assert found.bending == pytest.approx(0.0, abs=1e-15)


def test_cylinder_has_the_bending_energy_of_the_plate():
    rigidity = 2.0e6 * 4.0e-4**3 / (12.0 * (1.0 - 0.3**2))
    found = FabricEnergy(MESH, PLATE).energy(rolled(0.2))
    assert found.bending == pytest.approx(0.06 * rigidity / (2.0 * 0.2**2), rel=0.02)
    assert found.elastic == found.stretch + found.bending
    assert (found - found) == Energy(0.0, 0.0, 0.0)


def test_elastic_energy_is_the_simulators_own_and_its_force_the_slope():
    x = rolled(0.15) + 1e-3 * np.random.default_rng(0).normal(size=FLAT.shape)
    ask = FabricEnergy(MESH, JERSEY)
    sim = ClothSimulator(build_cloth(MESH, JERSEY), x, np.zeros((0, 3)), np.zeros((0, 3), np.int32))
    value = wp.zeros(1, dtype=wp.float64)
    sim.elastic.add_value(sim.x, 0.0, value)
    assert ask.energy(x).elastic == pytest.approx(float(value.numpy()[0]), rel=1e-13)

    gradient = wp.zeros(len(x), dtype=wp.vec3d)
    sim.linear.clear()
    sim.elastic.add_derivatives(sim.x, 0.0, gradient, sim.linear.matrix)
    slope = gradient.numpy() + build_cloth(MESH, JERSEY).mass[:, None] * [0.0, 9.81, 0.0]
    way = np.random.default_rng(1).normal(size=x.shape)
    h = 1e-7
    difference = (ask.energy(x + h * way).total - ask.energy(x - h * way).total) / (2 * h)
    assert difference == pytest.approx((slope * way).sum(), rel=1e-6)


def test_metrics_of_strain_and_folds_are_what_the_simulator_takes():
    x = rolled(0.15) + 1e-3 * np.random.default_rng(2).normal(size=FLAT.shape)
    panels = MESH.panel_vertices[MESH.panel_faces]
    strain, (c11, c12, c22, c33) = green_strain(x, MESH.faces, panels), PLATE.stretch_rest
    density = c11 * strain.warp**2 + c22 * strain.weft**2
    density += 2.0 * c12 * strain.warp * strain.weft + c33 * strain.shear**2
    assert FabricEnergy(MESH, PLATE).energy(x).stretch == pytest.approx(corner_areas(panels) @ density)

    cloth = build_cloth(MESH, PLATE)
    elastic = ElasticEnergy(cloth, "cpu")
    inputs = [wp.array(x, dtype=wp.vec3d), elastic.bend, elastic.bend_state]
    wp.launch(bend_angle, len(cloth.hinges), inputs)
    edges = hinges(MESH.faces)
    simulated, measured = (
        dict(zip(map(frozenset, ends[:, :2].tolist()), angles, strict=True))
        for ends, angles in (
            (cloth.hinges, elastic.bend_state.angle.numpy()),
            (edges, dihedral_angles(x, edges)),
        )
    )
    assert measured == pytest.approx(simulated, abs=1e-12)


def test_drape_at_rest_has_less_energy_than_anything_near_it():
    mesh = rectangle(0.2, 0.2, 6, 6, "irregular")
    x = np.insert(mesh.panel_vertices, 1, 0.0, axis=1)
    settings = SolverSettings(tolerance=1e-9, max_iterations=40, linear_tolerance=1e-6)
    sim = ClothSimulator(
        build_cloth(mesh, JERSEY), x, np.zeros((0, 3)), np.zeros((0, 3), np.int32), solver=settings
    )
    sim.pins = (mesh.panel_vertices[:, 1] < 1e-9) & (np.abs(mesh.panel_vertices[:, 0] - 0.1) > 0.09)
    for _ in range(20):
        sim.advance(None, 0.1, inertia=False)
    ask, rng = FabricEnergy(mesh, JERSEY), np.random.default_rng(0)
    rest = ask.energy(sim.positions).total
    assert rest < ask.energy(x).total
    for size in (1e-4, 1e-3, 1e-2):
        for _ in range(5):
            push = size * rng.normal(size=x.shape)
            push[sim.pins] = 0.0
            assert ask.energy(sim.positions + push).total > rest


def test_every_garment_has_its_own_fabric():
    both = merge_meshes(["inner", "outer"], [MESH, MESH])
    x = np.concatenate([rolled(0.2), rolled(0.3)])
    found = FabricEnergy(both, [JERSEY, PLATE]).energy(x)
    parts = FabricEnergy(MESH, JERSEY).energy(rolled(0.2)), FabricEnergy(MESH, PLATE).energy(rolled(0.3))
    assert found.total == pytest.approx(parts[0].total + parts[1].total)
    assert found.bending == pytest.approx(parts[0].bending + parts[1].bending)


def test_fabric_and_gravity_come_from_the_scene_of_a_sample(make_sample):
    sample = make_sample()
    scene = {"body": {}, "fabric_scale": {"density": 2.0}, "gravity": [0.0, -5.0, 0.0]}
    scene = parse_scene(scene).model_dump(mode="json")
    x = sample.frame_positions(0).astype(np.float64)
    scaled = FabricEnergy.of_sample(replace(sample, scene=scene)).energy(x)
    plain = FabricEnergy.of_sample(sample).energy(x)
    assert scaled.gravity == pytest.approx(plain.gravity * 2.0 * 5.0 / 9.81)
    assert scaled.stretch == plain.stretch


@pytest.mark.parametrize(
    "call",
    [
        lambda: FabricEnergy(MESH, [JERSEY, PLATE]),
        lambda: FabricEnergy(MESH, JERSEY, (0.0, np.nan, 0.0)),
        lambda: FabricEnergy(replace(MESH, faces=MESH.faces[:-1]), JERSEY),
        lambda: FabricEnergy(MESH, JERSEY).energy(FLAT[:-1]),
        lambda: FabricEnergy(MESH, JERSEY).energy(np.where(FLAT > 0.1, np.nan, FLAT)),
    ],
)
def test_bad_input_is_named(call):
    with pytest.raises(InputError):
        call()


def test_sample_without_a_fabric_is_named(make_sample):
    with pytest.raises(InputError, match="fabric"):
        FabricEnergy.of_sample(make_sample(fabric=""))


def test_warp_is_loaded_only_when_an_energy_is_asked_for():
    code = "import sys, muslin.eval.fabric_energy; sys.exit('warp' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0
