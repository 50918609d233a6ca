"""Pattern files: exact round trip, and one clear error for each way a file can be wrong."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

from muslin.garments import catalogue
from muslin.garments.errors import InputError
from muslin.garments.pattern import Pattern
from muslin.garments.pattern_file import read_pattern, write_pattern

TEE = catalogue.get("tee")


@pytest.mark.parametrize("preset", TEE.presets)
def test_round_trip_is_exact(preset: str, tmp_path: Path) -> None:
    pattern = TEE.pattern(**TEE.preset(preset))
    write_pattern(pattern, tmp_path / "tee.json")
    assert read_pattern(tmp_path / "tee.json") == pattern
    first = (tmp_path / "tee.json").read_bytes()
    write_pattern(read_pattern(tmp_path / "tee.json"), tmp_path / "tee.json")
    assert (tmp_path / "tee.json").read_bytes() == first


@pytest.fixture
def content(tmp_path: Path) -> dict[str, Any]:
    write_pattern(TEE.pattern(), tmp_path / "tee.json")
    return json.loads((tmp_path / "tee.json").read_text())


def change(content: dict[str, Any], path: list[str | int], value: Any) -> None:
    target: Any = content
    for key in path[:-1]:
        target = target[key]
    target[path[-1]] = value


@pytest.mark.parametrize(
    ("path", "value", "message"),
    [
        (["format"], "dxf", "format = \"dxf\" is not allowed; it must be 'muslin-pattern'"),
        (["schema_version"], 2, "schema_version = 2 is not allowed.*newer muslin"),
        (["unit"], "cm", "unit = \"cm\".*convert the coordinates to metres"),
        (["colour"], "red", "unknown key 'colour'; allowed: format, name"),
        (["name"], "", "name = \"\""),
        (["parameters"], [1], "parameters = .*a table of numbers"),
        (["parameters", "sleeve_length"], "long", "parameters.sleeve_length = \"long\".*finite number"),
        (["panels"], {}, "panels = {}.*a list"),
        (["panels"], [], "no panels"),
        (["panels", 0, "edges", 1, "start"], [0.1], r"panels\[0\]\.edges\[1\]\.start = .*two numbers"),
        (["panels", 0, "edges", 1, "start"], [0.1, float("nan")], r"start = NaN.*finite number"),
        (["panels", 0, "edges", 1, "start"], [9.0, 0.0], "seam edges do not match|crosses itself"),
        (["panels", 0, "edges", 0, "controls"], [[0, 0]], r"controls = .*two points"),
        (["panels", 0, "edges", 0], [], r"panels\[0\]\.edges\[0\] = .*a table"),
        (["panels", 0, "name"], "a.b", "without a dot"),
        (["seams", 0], ["front.hem"], r"seams\[0\] = .*two edges"),
        (["seams", 0], ["front.hem", "back.waist"], "no edge 'waist'"),
        (["seams", 0, 1], "back.hem", "seam edges do not match"),
    ],
)  # fmt: skip
def test_wrong_entries_are_named(
    content: dict[str, Any], tmp_path: Path, path: list[str | int], value: Any, message: str
) -> None:
    change(content, path, value)
    file = tmp_path / "wrong.json"
    file.write_text(json.dumps(content))
    with pytest.raises(InputError, match=message) as caught:
        read_pattern(file)
    assert str(caught.value).startswith(str(file))


def test_missing_key_broken_json_and_missing_file_are_named(content: dict[str, Any], tmp_path: Path) -> None:
    del content["seams"]
    (tmp_path / "a.json").write_text(json.dumps(content))
    with pytest.raises(InputError, match="the file lacks 'seams'"):
        read_pattern(tmp_path / "a.json")
    (tmp_path / "b.json").write_text('{"format": ')
    with pytest.raises(InputError, match="is not JSON"):
        read_pattern(tmp_path / "b.json")
    (tmp_path / "c.json").write_bytes(b"\xff\xfe\x00")
    with pytest.raises(InputError, match="is not JSON"):
        read_pattern(tmp_path / "c.json")
    with pytest.raises(InputError, match="cannot be read: No such file"):
        read_pattern(tmp_path / "none.json")


def test_unsound_pattern_does_not_destroy_the_file(tmp_path: Path) -> None:
    file = tmp_path / "tee.json"
    write_pattern(TEE.pattern(), file)
    before = file.read_bytes()
    with pytest.raises(InputError, match="no panels"):
        write_pattern(Pattern("none", (), ()), file)
    assert file.read_bytes() == before
    assert list(tmp_path.iterdir()) == [file]
