"""A shirt under a dress: put on without a crossing, the dress outside, merged without loss."""

from __future__ import annotations

import numpy as np
import pytest
import warp as wp

from muslin.garments import catalogue
from muslin.garments.mesh import GarmentMesh
from muslin.garments.triangulate import triangulate
from muslin.sim.body.load import load_body
from muslin.sim.body.skinning import bind
from muslin.sim.cloth import ClothModel, build_cloth, merge_cloths
from muslin.sim.contact.system import ContactSettings
from muslin.sim.dataset.intersections import count_intersections
from muslin.sim.elastic import ElasticEnergy
from muslin.sim.layers import dress
from muslin.sim.material import load_fabric
from muslin.sim.solve.settings import SolverSettings
from muslin.sim.solve.simulator import ClothSimulator

SHIRT = load_fabric("gray-interlock")
JEANS = load_fabric("11oz-black-denim")


def energy(cloth: ClothModel, x: np.ndarray) -> float:
    out = wp.zeros(1, dtype=wp.float64)
    ElasticEnergy(cloth, "cpu").add_value(wp.array(x, dtype=wp.vec3d), 0.0, out)
    return float(out.numpy()[0])


def test_a_merged_cloth_has_the_energy_and_mass_of_its_parts(sheet_mesh: GarmentMesh) -> None:
    parts = [build_cloth(sheet_mesh, SHIRT), build_cloth(sheet_mesh, JEANS), build_cloth(sheet_mesh, SHIRT)]
    merged = merge_cloths([merge_cloths(parts[:2]), parts[2]])
    rng = np.random.default_rng(1)
    flat = np.insert(sheet_mesh.panel_vertices, 2, 0.0, axis=1)
    places = [1.1 * flat + 0.01 * rng.normal(size=flat.shape) for _ in parts]
    energies = [energy(cloth, x) for cloth, x in zip(parts, places, strict=True)]
    assert energy(merged, np.concatenate(places)) == pytest.approx(sum(energies), rel=1e-12)
    assert min(energies) > 0.0
    np.testing.assert_array_equal(merged.mass, np.concatenate([cloth.mass for cloth in parts]))
    assert [fabric.name for fabric in merged.fabrics] == [SHIRT.name, JEANS.name, SHIRT.name]


@pytest.fixture(scope="module")
def garments() -> list[GarmentMesh]:
    tee = catalogue.get("tee")
    return [triangulate(tee.pattern(**tee.preset(name)), 0.06) for name in ("top", "short_dress")]


@pytest.fixture(scope="module")
def worn(garments: list[GarmentMesh]) -> ClothSimulator:
    cloths = [build_cloth(mesh, fabric) for mesh, fabric in zip(garments, (SHIRT, JEANS), strict=True)]
    model = load_body("female")
    return dress(
        garments, cloths, model, np.zeros(model.num_betas), ContactSettings(), SolverSettings(), "cpu"
    )


def test_layers_do_not_cross_each_other_or_the_body(worn: ClothSimulator) -> None:
    body = load_body("female")
    np.testing.assert_array_equal(worn.collider_vertices, body.vertices())
    counts = count_intersections(worn.positions, worn.cloth.faces, worn.collider_vertices, body.faces)
    assert (counts.cloth_cloth, counts.cloth_body) == (0, 0)


def test_the_dress_lies_over_the_shirt(worn: ClothSimulator, garments: list[GarmentMesh]) -> None:
    """Round the trunk, the outer layer is farther from the skin."""
    x = worn.positions
    binding = bind(x, load_body("female"))
    outer = np.arange(len(x)) >= garments[0].num_vertices
    height = x[:, 1] - x[~outer, 1].min()
    trunk = (binding.weights[:, [0, 3, 6, 9]].sum(axis=1) > 0.9) & (height > 0.05)
    inner_gap, outer_gap = (np.median(binding.distances[trunk & side]) for side in (~outer, outer))
    assert outer_gap > inner_gap + 1e-3
    assert x[outer, 1].min() < x[~outer, 1].min() - 0.1, "the dress is the longer one"


def test_together_they_move_on(worn: ClothSimulator) -> None:
    body = load_body("female")
    report = worn.advance(body.vertices() + np.array([0.0, 0.0, 0.01]), 1.0 / 60.0)
    assert report.splits == 0
    counts = count_intersections(worn.positions, worn.cloth.faces, worn.collider_vertices, body.faces)
    assert (counts.cloth_cloth, counts.cloth_body) == (0, 0)
