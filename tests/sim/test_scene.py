"""Scene files: what they hold, what overrides change, and one clear error for everything that is wrong."""

import pytest

from muslin.garments.errors import InputError
from muslin.sim.scene import Scene, SolverTable, load_scene, parse_scene

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
        ("motion={end = 1.0}", ["motion = ", "exactly one of clip and random_walk"]),
        ("fabric={young = 1e6, poisson = 0.3}", ["fabric.thickness is missing"]),
        ("fabric={young = 0}", ["fabric.young = 0", "greater than 0"]),
        (
            "fabric={weight = 0, young = 1, poisson = 0, thickness = 1, density = 1}",
            ["fabric.weight", "young"],
        ),
        ("fabric=[3]", ["fabric = [3]", "string"]),
        ("layers=[{fabric = 'tin'}]", ["layers.0.fabric = 'tin'", "gray-interlock", "FILE.toml"]),
        ("layers=[{fabric = {young = -1}}]", ["layers.0.fabric.young = -1"]),
        ("layers=[{colour = 'red'}]", ["unknown key layers.0.colour", "edge_length, fabric, fabric_scale"]),
        ("layers=[{repeat = {count = [0, 1, 1]}}]", ["layers.0.repeat.count.0 = 0", "1"]),
        ("garment.position=[0, 1, 0]", ["garment.position", "put on, not placed"]),
        ("colliders=[{shape = 'plane'}]", ["[colliders] is for cloth without a body"]),
        ("pins=[{side = 'top'}]", ["[pins] is for cloth without a body"]),
        ("sequence.duration=1", ["[sequence] is for cloth without a body"]),
        ("air.wind=[0, 0]", ["air.wind.2 is missing"]),
        ("air.density=-1", ["air.density = -1"]),
        ("solver.max_work=0", ["solver.max_work = 0", "1"]),
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


BALL = {"shape": "sphere", "radius": 0.2}
TOP = {"side": "top"}


@pytest.mark.parametrize(
    ("values", "says"),
    [
        ({}, ["give a [body]", "[[colliders]]", "[sequence]"]),
        ({"colliders": [BALL], "motion": {"clip": "walk"}}, ["[motion] needs a [body]", "[sequence]"]),
        ({"colliders": [{"shape": "ball"}]}, ['colliders.0.shape = "ball"', "'sphere'", "'mesh'"]),
        ({"colliders": [{"radius": 1.0}]}, ["colliders.0.shape", "'sphere'"]),
        ({"colliders": [BALL | {"radius": -1.0}]}, ["colliders.0.radius = -1.0", "greater than 0"]),
        ({"colliders": [BALL, {"shape": "cone", "radius": 1.0}]}, ["colliders.1.height is missing"]),
        ({"colliders": [BALL | {"height": 1.0}]}, ["unknown key colliders.0.height", "position, radius"]),
        (
            {"colliders": [{"shape": "torus", "radius": 0.1, "rod": 0.2}]},
            ["rod = 0.2", "less than radius = 0.1"],
        ),
        ({"colliders": [BALL | {"start": 1.0, "stop": 0.5}]}, ["stop = 0.5", "later than start = 1.0"]),
        ({"colliders": [BALL | {"velocity": [0, 1, 0]}]}, ["colliders.0 moves", "[sequence]"]),
        ({"pins": [TOP | {"release": 1.0}]}, ["pins.0 moves or lets go", "[sequence]"]),
        ({"pins": [{}]}, ["pins.0", "exactly one of box and side"]),
        ({"pins": [TOP | {"box": [[0, 0], [1, 1]]}]}, ["pins.0", "exactly one of box and side"]),
        ({"pins": [{"box": [[0, 1], [1, 0]]}]}, ["box = [[0.0, 1.0], [1.0, 0.0]]", "lower corner"]),
        ({"pins": [{"side": "front"}]}, ['pins.0.side = "front"', "'top'"]),
        ({"sequence": {"duration": 0.0}}, ["sequence.duration = 0.0"]),
    ],
)
def test_worlds_that_make_no_sense(values, says):
    with pytest.raises(InputError) as error:
        parse_scene(values)
    for part in says:
        assert part in str(error.value)


@pytest.mark.parametrize(
    "values",
    [
        {"colliders": [BALL, {"shape": "plane"}]},
        {"pins": [TOP], "air": {"wind": [0.0, 0.0, 3.0]}},
        {
            "sequence": {"duration": 1.0},
            "fabric": {"young": 1e6, "poisson": 0.3, "thickness": 3e-4, "density": 0.2},
        },
        {"body": {}, "layers": [{"preset": "short_dress", "fabric": "mine.toml:tin"}]},
    ],
)
def test_a_world_survives_its_own_values(values):
    scene = parse_scene(values)
    assert parse_scene(scene.model_dump(mode="json")) == scene


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


@pytest.mark.parametrize(
    ("dt", "fps", "steps"),
    [
        (1.0 / 60.0, 30.0, 2),
        (1.0 / 60.0, 60.0, 1),
        (1.0 / 60.0, 25.0, 3),
        (0.05, 240.0, 1),
        (1e-3, 30.0, 34),
    ],
)
def test_a_frame_has_the_fewest_steps_of_at_most_dt(dt: float, fps: float, steps: int) -> None:
    assert SolverTable(dt=dt).substeps(fps) == steps
