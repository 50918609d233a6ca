"""Topologies fitted to a drape: one simulation for all, the same mesh in every drape, no intersection."""

from __future__ import annotations

import numpy as np
import pytest

from muslin.garments.errors import InputError
from muslin.sim.dataset.verify import verify_sample
from muslin.sim.run import simulate, simulate_chain
from muslin.sim.scene import Scene, parse_scene
from muslin.sim.topologies import same_simulation

TABLE = {"seed": 3, "target_area": 2.0e-3}


def on_sphere(height: float = 0.508, **changes) -> Scene:
    values = {
        "name": "ball",
        "garment": {"design": "sheet", "edge_length": 0.06, "position": [0.1, height, -0.2]},
        "colliders": [{"shape": "sphere", "radius": 0.2, "position": [0.1, 0.3, -0.2]}],
        "solver": {"settle_steps": 12},
    }
    return parse_scene(values | changes)


@pytest.fixture(scope="module")
def chain():
    """Source and two topologies of one drape, then one topology of another drape."""
    scenes = [
        on_sphere(),
        on_sphere(name="ball-t00", topology=TABLE),
        on_sphere(name="ball-t01", topology=TABLE | {"target_area": 4.0e-3}),
    ]
    return scenes, list(simulate_chain(scenes))


def test_fitted_samples_are_free_of_intersections_and_near_the_simulation(chain):
    scenes, (source, *fitted) = chain
    assert "transfer_error_mean_m" not in source.certificate.extra
    means = []
    for scene, sample in zip(scenes[1:], fitted, strict=True):
        assert verify_sample(sample.validate()).reason == ""
        assert (sample.id, parse_scene(sample.scene)) == (scene.name, scene)
        assert sample.garment.num_vertices < source.garment.num_vertices
        found = sample.certificate
        assert found.cloth_cloth_intersections == found.cloth_body_intersections == 0
        assert found.force_residual == source.certificate.force_residual
        assert 0.0 < found.extra["transfer_error_mean_m"] < found.extra["transfer_error_max_m"]
        means.append(found.extra["transfer_error_mean_m"])
        assert found.extra["interpolated_frames"] == 0
    assert means[0] < means[1], "larger triangles describe the drape less well"
    # Edges of 0.068 and 0.096 m, where folds have a third of the sphere's radius: h^2 / 8R is 9 and 17 mm.
    assert means[0] < 0.009
    assert means[1] < 0.017


def test_a_scene_alone_is_what_it_is_in_its_chain(chain):
    scenes, samples = chain
    assert simulate(scenes[1]).positions.tobytes() == samples[1].positions.tobytes()


def test_the_topology_depends_on_the_design_alone(chain):
    higher = simulate(on_sphere(0.51, fabric="11oz-black-denim", topology=TABLE)).garment
    here = chain[1][1].garment
    assert np.array_equal(higher.faces, here.faces)
    assert np.array_equal(higher.panel_vertices, here.panel_vertices)
    other = simulate(on_sphere(topology=TABLE | {"seed": 4})).garment
    assert not np.array_equal(other.panel_vertices, here.panel_vertices)


def test_a_topology_can_be_simulated_itself(chain):
    sample = simulate(on_sphere(topology=TABLE | {"fit": False}))
    assert np.array_equal(sample.garment.faces, chain[1][1].garment.faces)
    assert verify_sample(sample.validate()).reason == ""
    assert "transfer_error_mean_m" not in sample.certificate.extra
    assert not np.array_equal(sample.positions, chain[1][1].positions)


def test_which_scenes_come_from_one_simulation():
    fitted = on_sphere(name="b", topology=TABLE, seed=2)
    assert same_simulation(on_sphere(), fitted)
    assert same_simulation(on_sphere(topology=TABLE | {"seed": 9}), fitted)
    assert not same_simulation(on_sphere(fabric="11oz-black-denim"), fitted)
    assert not same_simulation(on_sphere(topology=TABLE | {"fit": False}), fitted)


def test_every_frame_of_a_sequence_is_fitted():
    sample = simulate(on_sphere(sequence={"duration": 0.1, "fps": 30.0}, topology=TABLE))
    assert sample.num_frames == 4
    assert verify_sample(sample.validate()).reason == ""


@pytest.mark.parametrize(
    ("changes", "says"),
    [
        ({"topology": TABLE | {"max_distortion": 1.05}, "solver": {"settle_steps": 1}}, "out of reach"),
        ({"topology": TABLE, "remesh": {"refine_angle": 0.5}}, "is fitted to a mesh that stays"),
        ({"topology": {"target_area": 0.0}}, "topology.target_area = 0"),
        ({"topology": {}}, "topology.target_area is missing"),
    ],
)
def test_topologies_that_cannot_be(changes, says):
    with pytest.raises(InputError, match=says):
        simulate(on_sphere(**changes))
