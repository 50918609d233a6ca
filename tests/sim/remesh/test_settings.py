"""The `[remesh]` table and its settings: ranges, order, what is off, and what errors say."""

from __future__ import annotations

from dataclasses import FrozenInstanceError

import pytest
from pydantic import ValidationError

from muslin.garments.errors import InputError
from muslin.sim.remesh.settings import RemeshSettings, RemeshTable
from muslin.sim.table_errors import explain


def test_every_criterion_is_off_until_it_is_given() -> None:
    settings = RemeshTable.model_validate({}).settings
    assert settings == RemeshSettings()
    assert settings.refine_angle is settings.refine_compression is settings.refine_velocity is None
    assert not settings.refine_obstacle


def test_a_table_is_its_settings() -> None:
    values = {"refine_angle": 0.3, "refine_compression": 0.005, "refine_velocity": 0.5, "every": 4}
    values |= {"refine_obstacle": True, "size_min": 0.01, "size_max": 0.1, "aspect_min": 0.5}
    assert RemeshTable.model_validate(values).settings == RemeshSettings(**values)


@pytest.mark.parametrize(
    ("key", "bad", "good"),
    [
        ("refine_angle", (0.0, -0.3, 3.3, float("nan"), "much"), (0.01, 0.3, 3.2, None)),
        ("refine_compression", (0.0, 2.0), (1e-4, 1.0, None)),
        ("refine_velocity", (0.0, 101.0), (1e-3, 100.0, None)),
        ("size_min", (0.0, 0.3, None), (1e-4, 0.2)),
        ("size_max", (0.009, 11.0, float("inf")), (0.01, 10.0)),
        ("aspect_min", (0.0, 1.1), (0.01, 1.0)),
        ("every", (0, 1.5), (1, 10_000)),
    ],
)
def test_values_out_of_range_are_named_with_what_is_allowed(key: str, bad: tuple, good: tuple) -> None:
    for value in good:
        assert getattr(RemeshSettings(**{key: value}), key) == value
    for value in bad:
        with pytest.raises(InputError, match=rf"^remesh: .*{key}.*correct it$"):
            RemeshSettings(**{key: value})


def test_sizes_out_of_order_are_both_named() -> None:
    with pytest.raises(InputError, match=r"size_min = 0.3: must be at most size_max = 0.2; correct it"):
        RemeshSettings(size_min=0.3)


def test_an_unknown_key_is_answered_with_the_known_ones() -> None:
    with pytest.raises(ValidationError) as caught:
        RemeshTable.model_validate({"refine_curvature": 0.3})
    said = explain(caught.value.errors()[0], RemeshTable)
    assert said.startswith("unknown key refine_curvature; allowed here are aspect_min, every, refine_angle")


def test_settings_do_not_change() -> None:
    with pytest.raises(FrozenInstanceError):
        RemeshSettings().every = 3  # type: ignore[misc]
