"""Every mistake in a dataset's file is answered with its key, its value and what is allowed."""

from __future__ import annotations

from pathlib import Path

import pytest

from muslin.garments.errors import InputError
from muslin.sim.dataset.config import load_config, parse_config
from muslin.sim.dataset.plan import plan

DEMO = """
name = "demo"
seed = 3

[scene]
fabric = "denim"
garment = { design = "tee", template = 400 }
body = { model = "female" }

[[designs]]
preset = "tshirt"
[[designs]]
preset = "long_dress"

[[shapes]]
name = "height"
sweep = { component = 0, start = -2.0, stop = 2.0, count = 5 }

[[sequences]]
clip = "cmu_07_01"
end = 4.0
designs = ["tshirt"]

[splits.test]
designs = ["long_dress"]
"""


@pytest.fixture
def demo(tmp_path: Path) -> Path:
    file = tmp_path / "demo.toml"
    file.write_text(DEMO)
    return file


def test_the_demo_is_ten_drapes_and_a_sequence(demo: Path) -> None:
    planned = plan(load_config(demo))
    assert [len(chain.jobs) for chain in planned.chains] == [5, 1, 5]
    assert [job.kind for job in planned.jobs].count("sequence") == 1
    assert {job.split for job in planned.jobs if job.labels["design"] == "long_dress"} == {"test"}
    drape, clip = planned.chains[0].jobs[0], planned.chains[1].jobs[0]
    assert drape.scene["body"] == {"model": "female", "beta": [-2.0]}
    assert drape.scene["garment"]["template"] == 400
    assert "motion" not in drape.scene
    assert clip.scene["motion"] == {"clip": "cmu_07_01", "start": 0.0, "fps": 30.0, "end": 4.0}


def test_overrides_reach_tables_lists_and_plain_words(demo: Path) -> None:
    config = load_config(
        demo, ["seed=5", "scene.fabric=silk", "scene.solver.dt=0.01", "designs.1.preset=top", "sequences=[]"]
    )
    assert (config.seed, config.scene["fabric"], config.scene["solver"]) == (5, "silk", {"dt": 0.01})
    assert config.designs[1].preset == "top"
    assert config.sequences == []


@pytest.mark.parametrize(
    ("override", "message"),
    [
        ("seed", "must be key=value"),
        ("seed.x=1", "seed is a value, not a table"),
        ("designs.7.preset=top", "7 must be a place from 0 to 1"),
        ("sed=1", "sed: unknown key; allowed here: name, seed"),
        ("seed=-1", r"seed = -1: .*greater than or equal to 0"),
        ("kind=film", r"kind = 'film': .*'drape', 'sequence' or 'both'"),
        ("name='a b'", "name = 'a b': .*pattern"),
    ],
)
def test_wrong_overrides(demo: Path, override: str, message: str) -> None:
    with pytest.raises(InputError, match=message):
        load_config(demo, [override])


@pytest.mark.parametrize(
    ("values", "message"),
    [
        (
            {"designs": [{"presets": "top"}]},
            r"designs\.0\.presets: unknown key; allowed here: name, design, preset",
        ),
        ({"designs": [{"random": {"cont": 2}}]}, r"random\.cont: unknown key; allowed here: count, ranges"),
        ({"shapes": [{"random": {"cont": 2}}]}, r"allowed here: count, components, limit"),
        ({"shapes": [{}]}, "exactly one of beta, sweep, random"),
        ({"shapes": [{"beta": [float("nan")]}]}, "finite number"),
        ({"shapes": [{"random": {"count": 0}}]}, "greater than or equal to 1"),
        ({"sequences": [{"clip": "a", "start": 2.0, "end": 1.0}]}, "must be later than start"),
        ({"sequences": [{"clip": "a", "fps": 0}]}, "greater than 0"),
        ({"splits": {"test": {"by": "design"}}}, "by and fraction together"),
        ({"splits": {"test": {"by": "colour", "fraction": 0.1}}}, "'sequence' or 'topology'"),
    ],
)
def test_wrong_values(values: dict, message: str) -> None:
    with pytest.raises(InputError, match=message):
        parse_config(values)


def test_files_that_are_not_there_or_not_toml(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"none\.toml: not readable"):
        load_config(tmp_path / "none.toml")
    (tmp_path / "bad.toml").write_text("a = ")
    with pytest.raises(InputError, match=r"bad\.toml: not TOML"):
        load_config(tmp_path / "bad.toml")
    (tmp_path / "latin.toml").write_bytes(b"name = '\xe9'")
    with pytest.raises(InputError, match=r"latin\.toml: not readable"):
        load_config(tmp_path / "latin.toml")
