"""What is written as TOML is read back the same."""

from __future__ import annotations

import tomllib
from typing import Any

import pytest

from muslin.sim.dataset.toml_text import toml_text


@pytest.mark.parametrize(
    "values",
    [
        {"a": 1, "b": -2.5e-7, "c": 1e16, "d": True, "e": 'quo"te\\ \n\t\x7f é 😀', "f": [1.0, [2], []]},
        {"x": {"y": {"z": 1, "empty": {}}, "list": []}, "last": 2},
        {"t": [{"a": 1, "u": [{"b": 2}, {"b": {"c": 3}}]}, {"a": 2}], "odd key": {"dot.ted": "v"}},
        {"mixed": [1, {"a": {"b": "c"}}]},
    ],
)
def test_round_trip(values: dict[str, Any]) -> None:
    assert tomllib.loads(toml_text(values)) == values


def test_what_toml_does_not_know_is_left_out() -> None:
    given = {"none": None, "table": {"none": None, "kept": [{"none": None}, {"k": 0}]}, "empty": {}, "no": []}
    assert tomllib.loads(toml_text(given)) == {"table": {"kept": [{}, {"k": 0}]}}
    with pytest.raises(ValueError, match="not JSON compliant"):
        toml_text({"x": float("nan")})
