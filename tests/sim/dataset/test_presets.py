"""A preset is merged over its file, overrides come last, and nothing of the presets is left in the result."""

from __future__ import annotations

from pathlib import Path

import pytest

from muslin.garments.errors import InputError
from muslin.sim.dataset.config import load_config
from muslin.sim.dataset.plan import plan

FILE = """
name = "demo"
kind = "drape"
[scene]
fabric = "denim"
garment = { design = "tee", template = 4000 }
[[designs]]
preset = "tshirt"
[[designs]]
preset = "top"
[presets.small.scene.garment]
template = 403
[presets.whole]
[presets.top]
designs = [{ preset = "top" }]
"""


@pytest.fixture
def file(tmp_path: Path) -> Path:
    path = tmp_path / "demo.toml"
    path.write_text(FILE)
    return path


def test_tables_are_merged_and_lists_replaced(file: Path) -> None:
    small, top = load_config(file, preset="small"), load_config(file, preset="top")
    assert small.scene == {"fabric": "denim", "garment": {"design": "tee", "template": 403}}
    assert [design.preset for design in small.designs] == ["tshirt", "top"]
    assert [design.preset for design in top.designs] == ["top"]
    assert top.scene["garment"]["template"] == 4000


def test_without_a_preset_the_file_is_what_stands_outside_of_them(file: Path) -> None:
    assert load_config(file) == load_config(file, preset="whole")
    assert "presets" not in load_config(file).model_dump()
    bare = file.with_name("bare.toml")
    bare.write_text(FILE[: FILE.index("[presets")])
    assert load_config(bare) == load_config(file)


def test_overrides_come_after_the_preset(file: Path) -> None:
    config = load_config(file, ["scene.garment.template=1400"], preset="small")
    assert config.scene["garment"]["template"] == 1400


def test_ids_are_those_of_the_values_wherever_they_stand(file: Path) -> None:
    by_preset = plan(load_config(file, preset="small"))
    by_hand = plan(load_config(file, ["scene.garment.template=403"]))
    assert [job.id for job in by_preset.jobs] == [job.id for job in by_hand.jobs]


def test_a_preset_that_is_not_there(file: Path) -> None:
    with pytest.raises(InputError, match=r"no preset 'tiny'; there are small, whole, top"):
        load_config(file, preset="tiny")
    file.write_text(FILE[: FILE.index("[presets")])
    with pytest.raises(InputError, match=r"no preset 'tiny'; the file has none"):
        load_config(file, preset="tiny")
    file.write_text("presets = 3")
    with pytest.raises(InputError, match=r"presets: must be tables"):
        load_config(file)


def test_what_a_preset_sets_wrongly_is_named(file: Path) -> None:
    file.write_text(FILE + "[presets.bad]\nsede = 1\n")
    with pytest.raises(InputError, match=r"sede: unknown key; allowed here: name, seed"):
        load_config(file, preset="bad")
