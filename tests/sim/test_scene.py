"""Scene files: what they hold, what overrides change, and one clear error for everything that is wrong."""

import pytest

from muslin.garments.errors import InputError
from muslin.sim.scene import Scene, load_scene, parse_scene

MINIMAL = '[body]\nmodel = "female"\n'


@pytest.fixture
def scene_file(tmp_path):
    def write(text: str):
        path = tmp_path / "scene.toml"
        path.write_text(text, encoding="utf-8")
        return path

    return write


def test_everything_but_the_body_has_a_default(scene_file):
    scene = load_scene(scene_file(MINIMAL))
    assert scene.body is not None
    assert scene.body.model == "female"
    assert scene.motion is None
    assert scene == parse_scene({"body": {"model": "female"}})


def test_a_scene_survives_its_own_values():
    scene = parse_scene(
        {
            "name": "walk-1",
            "garment": {"preset": "long_dress", "parameters": {"garment_length": 1.2}, "edge_length": 0.03},
            "body": {"model": "male", "beta": [1.0, -2.0]},
            "motion": {"clip": "walk", "start": 0.5, "end": 1.5},
            "solver": {"dt": 0.01},
            "expect": {"frames": 31, "lowest_point": [0.0, 0.4]},
        }
    )
    assert parse_scene(scene.model_dump(mode="json")) == scene


@pytest.mark.parametrize(
    ("override", "table", "key", "value"),
    [
        ("body.beta=[2.0, -1]", "body", "beta", [2.0, -1]),
        ("body.model=male", "body", "model", "male"),
        ('body.model="a b.npz"', "body", "model", "a b.npz"),
        ("solver.dt=0.01", "solver", "dt", 0.01),
        ("garment.parameters.sleeve_length=0.3", "garment", "parameters", {"sleeve_length": 0.3}),
        ("motion.clip=/data/B3 - walk1_poses.npz", "motion", "clip", "/data/B3 - walk1_poses.npz"),
        ("motion={clip = 'walk', end = 2}", "motion", "end", 2.0),
    ],
)
def test_override(scene_file, override, table, key, value):
    scene = load_scene(scene_file(MINIMAL), [override])
    assert getattr(getattr(scene, table), key) == value


def test_the_last_override_counts(scene_file):
    assert load_scene(scene_file(MINIMAL), ["seed=3", "seed=4"]).seed == 4


@pytest.mark.parametrize(
    ("override", "says"),
    [
        ("seed", ["'seed'", "key=value"]),
        ("=3", ["'=3'", "key=value"]),
        ("fabric.name=tin", ["'fabric.name=tin'", "fabric is a value, not a table"]),
    ],
)
def test_bad_override(scene_file, override, says):
    path = scene_file('fabric = "gray-interlock"\n' + MINIMAL)
    with pytest.raises(InputError) as error:
        load_scene(path, [override])
    assert all(part in str(error.value) for part in says)


@pytest.mark.parametrize(
    ("override", "says"),
    [
        ("speed=3", ["unknown key speed", "allowed here are", "gravity"]),
        ("solver.steps=3", ["unknown key solver.steps", "settle_steps"]),
        ("body.gender=f", ["unknown key body.gender", "beta, model, pose"]),
        ("motion.file=walk", ["motion"]),
        ("expect.stretch=1", ["unknown key expect.stretch", "largest_stretch"]),
        ("solver.dt=0.5", ["solver.dt = 0.5", "0.05"]),
        ("solver.dt=fast", ['solver.dt = "fast"', "number"]),
        ("garment.edge_length=0", ["garment.edge_length = 0", "0.002"]),
        ("garment.edge_length=nan", ["garment.edge_length"]),
        ("body.beta=[0, 9]", ["body.beta.1 = 9", "5"]),
        ("body.beta=[inf]", ["body.beta.0"]),
        ("body.pose=x", ["body.pose", "'a' or 't'"]),
        ("gravity=[0, -9.81]", ["gravity"]),
        ("gravity=[0, nan, 0]", ["gravity.1"]),
        ("friction_body=-1", ["friction_body = -1", "0"]),
        ("fabric=tin", ["fabric = 'tin'", "choose one of", "gray-interlock"]),
        ("name=a/b", ['name = "a/b"', "pattern"]),
        ("motion.clip=3", ["motion.clip = 3", "string"]),
        ("collider.sphere_radius=0.2", ["exactly one of [body] and [collider]"]),
        ("expect.frames=0", ["expect.frames = 0", "1"]),
    ],
)
def test_wrong_value(scene_file, override, says):
    path = scene_file(MINIMAL)
    with pytest.raises(InputError) as error:
        load_scene(path, [override])
    message = str(error.value)
    assert message.startswith(str(path)), "names the file"
    for part in says:
        assert part in message
    assert "\n" not in message


def test_no_body_and_motion_without_body():
    with pytest.raises(InputError, match=r"exactly one of \[body\] and \[collider\]"):
        parse_scene({})
    with pytest.raises(InputError, match=r"\[motion\] needs a \[body\]"):
        parse_scene({"collider": {"sphere_radius": 0.2}, "motion": {"clip": "walk"}})


def test_missing_and_broken_files(tmp_path, scene_file):
    with pytest.raises(InputError, match=r"none\.toml: not readable .*give the TOML file of a scene"):
        load_scene(tmp_path / "none.toml")
    with pytest.raises(InputError, match="not readable"):
        load_scene(tmp_path)
    with pytest.raises(InputError, match=r"not TOML .*line 2"):
        load_scene(scene_file("[body]\nmodel = \n"))
    (tmp_path / "scene.toml").write_bytes(b"name = '\xff'")
    with pytest.raises(InputError, match="not readable"):
        load_scene(tmp_path / "scene.toml")


def test_scenes_cannot_be_changed():
    scene = parse_scene({"body": {}})
    assert isinstance(scene, Scene)
    with pytest.raises(ValueError, match="frozen"):
        scene.seed = 3
