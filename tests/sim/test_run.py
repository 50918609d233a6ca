"""From scenes to samples: chains, the same bytes twice, and what is said of scenes that cannot be."""

import numpy as np
import pytest

from muslin.garments import catalogue
from muslin.garments.errors import InputError
from muslin.garments.pattern_file import write_pattern
from muslin.sim.dataset.verify import verify_sample
from muslin.sim.run import SimulationError, compile_kernels, cut_garment, simulate, simulate_chain
from muslin.sim.scene import Scene, parse_scene

COARSE = {"preset": "top", "edge_length": 0.07}
QUICK = {"settle_steps": 3, "dt": 0.034}


def sphere_scene(**changes) -> Scene:
    values = {
        "name": "ball",
        "garment": {"design": "sheet", "edge_length": 0.1, "position": [0.1, 0.508, -0.2]},
        "colliders": [{"shape": "sphere", "radius": 0.2, "position": [0.1, 0.3, -0.2]}],
        "solver": {"settle_steps": 20},
    }
    return parse_scene(values | changes)


def body_scene(**changes) -> Scene:
    return parse_scene({"name": "worn", "garment": COARSE, "body": {}, "solver": QUICK} | changes)


@pytest.fixture(scope="module")
def drapes():
    """A chain of two shapes, and the progress it told of."""
    told = []
    shapes = ({"beta": [0.5], "pose": "t"}, {"beta": [0.5, 0.4], "pose": "t"})
    scenes = [body_scene(body=shape) for shape in shapes]
    return scenes, list(simulate_chain(scenes, progress=lambda *state: told.append(state))), told


def test_chain_of_drapes(drapes):
    scenes, samples, _ = drapes
    assert len(samples) == 2
    for scene, sample in zip(scenes, samples, strict=True):
        assert verify_sample(sample.validate()).reason == ""
        assert (sample.kind, sample.num_frames, sample.fps) == ("drape", 1, None)
        assert sample.body is not None
        assert scene.body is not None
        assert sample.body.beta[: len(scene.body.beta)].tolist() == scene.body.beta
        assert not sample.body.beta[len(scene.body.beta) :].any()
        assert abs(sample.body_vertices(0)[:, 1].min()) < 1e-6, "stands on the floor"
        found = sample.certificate
        assert found.cloth_cloth_intersections == found.cloth_body_intersections == 0
        assert found.force_residual is not None
        assert found.force_residual > 0
        assert found.extra["settle_steps"] >= 3
        assert found.extra["at_rest"] is False
        assert parse_scene(sample.scene) == scene
    first, second = samples
    assert np.array_equal(first.garment.faces, second.garment.faces)
    assert not np.array_equal(first.positions, second.positions)


def test_chain_begins_like_its_first_scene_alone(drapes):
    scenes, samples, _ = drapes
    assert simulate(scenes[0]).positions.tobytes() == samples[0].positions.tobytes()


def test_progress_ends_at_its_end(drapes):
    told = drapes[2]
    done = [state[0] for state in told]
    assert 0 < min(done) <= max(done) <= told[0][1]
    assert len({state[1] for state in told}) == 1
    assert told[-1][0] == told[-1][1]


def test_a_sequence_has_its_frames_and_its_bytes_again():
    scene = body_scene(motion={"clip": "walk", "start": 0.2, "end": 0.27, "fps": 30})
    sample = simulate(scene)
    assert (sample.kind, sample.num_frames, sample.fps) == ("sequence", 3, 30.0)
    assert verify_sample(sample.validate()).reason == ""
    assert sample.labels["sequence"] == "walk"
    assert sample.certificate.force_residual is None
    # The cloth travels with the wearer.
    cloth = np.diff(sample.positions.mean(axis=1), axis=0)
    body = np.diff([sample.body_vertices(k).mean(axis=0) for k in range(3)], axis=0)
    assert np.linalg.norm(cloth.sum(axis=0) - body.sum(axis=0)) < 0.03
    again = simulate(scene)
    assert again.positions.tobytes() == sample.positions.tobytes()
    assert [m.tobytes() for m in again.masked_faces] == [m.tobytes() for m in sample.masked_faces]


def test_sheet_on_a_sphere_has_its_bytes_again():
    scene = sphere_scene()
    sample = simulate(scene)
    assert verify_sample(sample.validate()).reason == ""
    assert simulate(scene).positions.tobytes() == sample.positions.tobytes()
    assert sample.positions[..., 1].max() > 0.3 + 0.2, "lies on top"
    assert sample.positions[..., 1].min() < 0.3, "hangs down"
    np.testing.assert_allclose(sample.positions.mean(axis=1)[0, [0, 2]], [0.1, -0.2], atol=0.03)


@pytest.mark.parametrize("changes", [{"fabric_scale": {"bend": 100.0}}, {"gravity": [0, -1.6, 0]}])
def test_stiff_and_light_cloth_hangs_less(changes):
    positions = [simulate(sphere_scene(**values)).positions for values in ({}, changes)]
    hanging, stiff = (np.sort(values[0, :, 1])[:8].mean() for values in positions)
    assert stiff > hanging + 1e-3


def test_pattern_file_gives_the_garment_it_was_written_from(tmp_path):
    design = catalogue.get("tee")
    write_pattern(design.pattern(**design.preset("top")), tmp_path / "top.json")
    by_file = cut_garment(parse_scene({"body": {}, "garment": {"pattern": str(tmp_path / "top.json")}}))
    by_name = cut_garment(parse_scene({"body": {}, "garment": {"preset": "top"}}))
    assert np.array_equal(by_file.faces, by_name.faces)
    np.testing.assert_allclose(by_file.panel_vertices, by_name.panel_vertices, atol=1e-9)


def test_template_shares_its_connectivity():
    short, long = (
        cut_garment(parse_scene({"body": {}, "garment": {"preset": preset, "template": 403}}))
        for preset in ("top", "long_dress")
    )
    assert np.array_equal(short.faces, long.faces)


@pytest.mark.parametrize(
    ("changes", "says"),
    [
        ({"garment": {"design": "cape"}}, ["cape", "tee"]),
        ({"garment": {"preset": "gown"}}, ["gown", "tshirt"]),
        ({"garment": {"parameters": {"sleeve": 0.2}}}, ["sleeve", "sleeve_length"]),
        ({"garment": {"parameters": {"sleeve_length": 9.0}}}, ["sleeve_length", "9"]),
        ({"garment": {"pattern": "none.json"}}, ["none.json"]),
        ({"garment": {"template": 17}}, ["17"]),
        ({"garment": {"design": "sheet", "edge_length": 0.2}}, ["cannot place", "front"]),
        ({"body": {"model": "robot"}}, ["robot", "female, male, neutral"]),
        ({"body": {"model": "none.npz"}}, ["none.npz", "does not exist"]),
        ({"body": {"beta": [0.0] * 40}}, ["body.beta holds 40 values", "female", "10"]),
    ],
)
def test_scene_that_cannot_be(changes, says):
    with pytest.raises(InputError) as error:
        simulate(body_scene(**changes))
    for part in says:
        assert part in str(error.value)


def test_worn_garments_do_not_lie_on_spheres():
    with pytest.raises(InputError, match=r'has 4 panels.*design = "sheet"'):
        simulate(sphere_scene(garment={"edge_length": 0.1}))


def test_chain_of_different_garments():
    scenes = [body_scene(), body_scene(name="other", garment=COARSE | {"preset": "tshirt"})]
    with pytest.raises(InputError, match=r"scene other: garment differ from scene .*start another chain"):
        next(simulate_chain(scenes))


def test_chain_with_a_sequence():
    scenes = [body_scene(), body_scene(name="other", motion={"clip": "walk", "end": 0.1})]
    with pytest.raises(InputError, match=r"scene other: a sequence .* give it alone"):
        next(simulate_chain(scenes))


def test_nothing_to_do():
    assert list(simulate_chain([])) == []


def test_motion_that_is_not_there():
    with pytest.raises(InputError, match=r"moonwalk.*walk_left.*\.npz"):
        simulate(body_scene(motion={"clip": "moonwalk"}))


def test_device_that_is_not_there():
    with pytest.raises(InputError, match=r"device 'cuda:99': not available here; choose one of .*cpu"):
        compile_kernels("cuda:99")


def test_a_spent_budget_names_scene_and_stage():
    with pytest.raises(
        SimulationError, match=r"scene ball: the budget of Newton iterations is spent"
    ) as error:
        simulate(sphere_scene(solver={"max_work": 2}))
    assert error.value.state is not None
