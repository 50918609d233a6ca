"""A shirt under a dress: put on, at rest, in motion, and merged without loss."""

from __future__ import annotations

import numpy as np
import pytest
import warp as wp

from muslin.garments.merge import face_owner
from muslin.garments.mesh import GarmentMesh
from muslin.sim.body.load import load_body
from muslin.sim.body.skinning import bind
from muslin.sim.cloth import build_cloth, merge_cloths
from muslin.sim.dataset.sample import Sample
from muslin.sim.dataset.verify import verify_sample
from muslin.sim.elastic import ElasticEnergy
from muslin.sim.material import load_fabric
from muslin.sim.run import simulate
from muslin.sim.scene import parse_scene

SHIRT = load_fabric("gray-interlock")
JEANS = load_fabric("11oz-black-denim")


def energy(cloth, x: np.ndarray) -> float:
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
def worn() -> Sample:
    """A few steps into a drape."""
    return simulate(
        parse_scene(
            {
                "name": "layers",
                "garment": {"preset": "top", "edge_length": 0.06},
                "layers": [{"preset": "short_dress", "edge_length": 0.06, "fabric": JEANS.name}],
                "body": {"pose": "t"},
                "solver": {"settle_steps": 4},
            }
        )
    )


def test_layers_do_not_cross_each_other_or_the_body(worn: Sample) -> None:
    finding = verify_sample(worn.validate())
    assert finding.reason == ""
    assert (finding.cloth_cloth, finding.cloth_body) == (0, 0)
    assert worn.fabric == "gray-interlock+11oz-black-denim"


def test_the_dress_lies_over_the_shirt(worn: Sample) -> None:
    """Round the trunk, the outer layer is farther from the skin."""
    model = load_body("female")
    assert worn.body is not None
    x = worn.positions[0].astype(np.float64)
    binding = bind(x, model, worn.body.beta, worn.body.poses[0], worn.body.translations[0])
    owner = np.zeros(len(x), int)
    owner[worn.garment.faces] = face_owner(worn.garment)[:, None]
    height = x[:, 1] - x[owner == 0, 1].min()
    trunk = (binding.weights[:, [0, 3, 6, 9]].sum(axis=1) > 0.9) & (height > 0.05)
    shirt, dress = (binding.distances[trunk & (owner == k)] for k in (0, 1))
    assert min(len(shirt), len(dress)) > 20
    assert np.median(dress) > np.median(shirt) + 1e-3
    assert x[owner == 1, 1].min() < x[owner == 0, 1].min() - 0.1, "the dress is the longer one"


def test_panels_are_named_by_their_garment(worn: Sample) -> None:
    assert {name.partition(".")[0] for name in worn.garment.panel_names} == {"top", "short_dress"}
    worn.garment.validate()
