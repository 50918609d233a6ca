"""Random scenes: valid ones are read, planned and simulated, invalid ones give the error, whatever they hold.

A pydantic model knows what it allows: values are drawn from the very tables that scenes are made of.
"""

from __future__ import annotations

import json
import string
from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, assume, given, settings
from hypothesis import strategies as st

from muslin.garments.errors import InputError
from muslin.sim.dataset.config import parse_config
from muslin.sim.dataset.plan import plan
from muslin.sim.dataset.verify import verify_sample
from muslin.sim.material import fabric_names
from muslin.sim.run import simulate
from muslin.sim.scene import parse_scene
from muslin.sim.solve.errors import SimulationError


def number(low: float, high: float) -> st.SearchStrategy[float]:
    return (
        st.floats(low, high, allow_nan=False)
        .map(lambda value: round(value, 6))
        .filter(lambda v: low <= v <= high)
    )


def vector(size: float) -> st.SearchStrategy[list[float]]:
    return st.lists(number(-size, size), min_size=3, max_size=3)


def table(required: dict[str, Any], optional: dict[str, Any]) -> st.SearchStrategy[dict[str, Any]]:
    return st.fixed_dictionaries(required, optional=optional)


MOVING = {"velocity": vector(2.0), "spin": vector(10.0), "start": number(0.0, 0.5), "stop": number(0.6, 2.0)}
PLACED = {
    "position": vector(1.0),
    "rotation": vector(4.0),
    "repeat": table({"count": st.lists(st.integers(1, 3), min_size=3, max_size=3), "step": vector(0.3)}, {}),
}
LENGTH = number(0.02, 0.5)
SHAPES = st.one_of(
    table({"shape": st.just("sphere"), "radius": LENGTH, "subdivisions": st.integers(0, 2)}, PLACED | MOVING),
    table({"shape": st.just("plane")}, {"size": number(0.1, 5.0)} | PLACED | MOVING),
    table({"shape": st.just("box"), "size": st.lists(LENGTH, min_size=3, max_size=3)}, PLACED | MOVING),
    table(
        {"shape": st.sampled_from(["cylinder", "cone"]), "radius": LENGTH, "height": LENGTH}, PLACED | MOVING
    ),
    table(
        {"shape": st.just("torus"), "radius": number(0.1, 0.5), "rod": number(0.01, 0.09)}, PLACED | MOVING
    ),
)
FABRIC = st.one_of(
    st.sampled_from(fabric_names()),
    table(
        {
            "young": number(1e3, 1e8),
            "poisson": number(-0.9, 0.5),
            "thickness": number(1e-4, 2e-3),
            "density": number(0.05, 1.0),
        },
        {},
    ),
)
SCALE = table({}, {"density": number(0.1, 10.0), "stretch": number(0.1, 10.0), "bend": number(0.1, 100.0)})
SHEET: dict[str, Any] = {
    "design": st.just("sheet"),
    "parameters": table({}, {"width": number(0.1, 0.4), "length": number(0.1, 0.4)}),
    "edge_length": number(0.08, 0.2),
}
PIN = table(
    {"side": st.sampled_from(["left", "right", "bottom", "top"])}, MOVING | {"release": number(0.01, 1.0)}
)
SOLVER = table(
    {},
    {
        "dt": number(1e-3, 0.05),
        "damping": number(0.0, 1.0),
        "drag": number(0.0, 100.0),
        "tolerance": number(1e-6, 1e-2),
        "max_iterations": st.integers(1, 20),
        "contact_range": number(5e-4, 1e-2),
        "contact_stiffness": number(0.1, 100.0),
    },
)
AIR = table(
    {},
    {
        "density": number(0.1, 10.0),
        "wind": vector(20.0),
        "across": number(0.0, 3.0),
        "along": number(0.0, 1.0),
    },
)
WORLD = table(
    {
        "garment": table(SHEET, PLACED),
        "sequence": table({"duration": number(0.02, 0.1)}, {"fps": number(20.0, 60.0)}),
    },
    {
        "layers": st.lists(table(SHEET, PLACED | {"fabric": FABRIC, "fabric_scale": SCALE}), max_size=2),
        "colliders": st.lists(SHAPES, max_size=3),
        "pins": st.lists(PIN, max_size=2),
        "fabric": FABRIC,
        "fabric_scale": SCALE,
        "friction_body": number(0.0, 2.0),
        "friction_cloth": number(0.0, 2.0),
        "gravity": vector(20.0),
        "air": AIR,
        "solver": SOLVER,
        "seed": st.integers(0, 2**40),
    },
)


@settings(max_examples=150, suppress_health_check=[HealthCheck.too_slow])
@given(values=WORLD)
def test_valid_worlds_are_read_and_written_back(values: dict[str, Any]) -> None:
    scene = parse_scene(values)
    assert parse_scene(json.loads(json.dumps(scene.model_dump(mode="json")))) == scene


@settings(max_examples=8, suppress_health_check=[HealthCheck.too_slow, HealthCheck.filter_too_much])
@given(values=WORLD)
def test_valid_worlds_play_without_an_intersection_or_say_why_not(values: dict[str, Any]) -> None:
    """A start that cannot be is an InputError, a squeeze with no way out a SimulationError: nothing else."""
    scene = parse_scene(values | {"solver": values.get("solver", {}) | {"dt": 0.05, "max_work": 60}})
    try:
        sample = simulate(scene)
    except (InputError, SimulationError):
        assume(False)
    finding = verify_sample(sample.validate())
    assert (finding.reason, finding.cloth_cloth, finding.cloth_body) == ("", 0, 0)
    assert np.isfinite(sample.positions).all()


def leaves(value: Any, path: tuple[Any, ...] = ()) -> list[tuple[tuple[Any, ...], Any]]:
    """Every place of a value in nested tables and lists."""
    if isinstance(value, dict | list):
        parts = value.items() if isinstance(value, dict) else enumerate(value)
        return [leaf for key, part in parts for leaf in leaves(part, (*path, key))]
    return [(path, value)]


def replaced(value: Any, path: tuple[Any, ...], new: Any) -> Any:
    if not path:
        return new
    changed = value.copy()
    changed[path[0]] = replaced(value[path[0]], path[1:], new)
    return changed


WRONG: list[Any] = ["wrong", [], None, {"wrong": 1}, float("nan"), float("inf"), True and [[1]]]


@settings(max_examples=250, suppress_health_check=[HealthCheck.too_slow])
@given(values=WORLD, data=st.data())
def test_a_wrong_value_anywhere_is_named(values: dict[str, Any], data: st.DataObject) -> None:
    places = [
        (path, value)
        for path, value in leaves(values)
        if isinstance(value, int | float) or path[-1] in ("shape", "side")
    ]
    path, old = data.draw(st.sampled_from(places))
    new = data.draw(st.sampled_from([wrong for wrong in WRONG if wrong is not None or path[-1] != "stop"]))
    with pytest.raises(InputError) as error:
        parse_scene(replaced(values, path, new))
    message = str(error.value)
    assert "\n" not in message
    assert str(path[0]) in message, (path, old, new, message)


@settings(max_examples=100, suppress_health_check=[HealthCheck.too_slow])
@given(values=WORLD, key=st.text(string.ascii_lowercase, min_size=12, max_size=14), data=st.data())
def test_an_unknown_key_anywhere_is_named(values: dict[str, Any], key: str, data: st.DataObject) -> None:
    tables = {path[:k] for path, _ in leaves(values) for k in range(len(path)) if isinstance(path[k], str)}
    place = data.draw(st.sampled_from(sorted(tables, key=str)))
    assume("parameters" not in place)
    inner = values
    for part in place:
        inner = inner[part]
    with pytest.raises(InputError, match=key):
        parse_scene(replaced(values, place, inner | {key: 1.0}))


@settings(max_examples=60, suppress_health_check=[HealthCheck.too_slow])
@given(
    scene=table(
        {},
        {
            "fabric": FABRIC,
            "fabric_scale": SCALE,
            "air": AIR,
            "solver": SOLVER,
            "layers": st.lists(table({}, {"preset": st.just("short_dress")}), max_size=2),
        },
    ),
    shapes=st.lists(number(-2.0, 2.0), min_size=1, max_size=4, unique=True),
    seed=st.integers(0, 2**40),
)
def test_valid_datasets_are_planned(scene: dict[str, Any], shapes: list[float], seed: int) -> None:
    config = {
        "seed": seed,
        "kind": "drape",
        "scene": scene | {"body": {}},
        "shapes": [{"beta": [b]} for b in shapes],
    }
    planned = plan(parse_config(config))
    assert len(planned.jobs) == len(shapes)
    for job in planned.jobs:
        assert parse_scene(job.scene).body is not None
