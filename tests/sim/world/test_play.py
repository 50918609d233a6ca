"""Worlds without a wearer: what was asked for is what the sample shows."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from muslin.garments.errors import InputError
from muslin.sim.dataset.verify import verify_sample
from muslin.sim.run import simulate
from muslin.sim.scene import parse_scene
from muslin.sim.solve.errors import SimulationError

SHEET = {"design": "sheet", "parameters": {"width": 0.3, "length": 0.2}, "edge_length": 0.1}
STANDING = SHEET | {"rotation": [np.pi / 2.0, 0.0, 0.0]}
BALL = {"shape": "sphere", "radius": 0.1, "subdivisions": 2}


def sample(**values: Any):
    made = simulate(parse_scene({"name": "world", "garment": SHEET} | values))
    finding = verify_sample(made.validate())
    assert finding.reason == ""
    assert (finding.cloth_cloth, finding.cloth_body) == (0, 0)
    return made


def test_free_fall_is_the_time_steps_own() -> None:
    made = sample(sequence={"duration": 0.1, "fps": 60}, solver={"drag": 0.0})
    assert made.num_frames == 7
    assert made.obstacle_vertices is None
    n = np.arange(7)
    fallen = -9.81 / 60.0**2 * n * (n + 1) / 2.0
    np.testing.assert_allclose(
        made.positions[:, :, 1], np.tile(fallen[:, None], made.positions.shape[1]), atol=1e-6
    )


def test_handles_go_where_they_are_told_to() -> None:
    spin = {"side": "top", "spin": [0.0, 2.0, 0.0], "velocity": [0.1, 0.0, 0.0]}
    made = sample(garment=STANDING, pins=[spin, {"side": "bottom"}], sequence={"duration": 0.2})
    y = made.garment.panel_vertices[:, 1]
    top = np.unique(made.garment.panel_to_vertex[np.isclose(y, 0.1)])
    bottom = np.unique(made.garment.panel_to_vertex[np.isclose(y, -0.1)])
    begin, end = made.positions[0], made.positions[-1]
    np.testing.assert_array_equal(end[bottom], begin[bottom])
    angle = 0.4
    x = begin[top, 0]
    expected = np.stack([0.02 + x * np.cos(angle), begin[top, 1], -x * np.sin(angle)], axis=1)
    np.testing.assert_allclose(end[top], expected, atol=1e-6)


def test_what_is_let_go_falls() -> None:
    made = sample(
        garment=STANDING, pins=[{"side": "top", "release": 0.1}], sequence={"duration": 0.2, "fps": 60}
    )
    top = made.positions[:, made.positions[0, :, 1].argmax(), 1]
    np.testing.assert_array_equal(top[:7], top[0])
    assert (np.diff(top[6:]) < 0.0).all()


def test_a_collider_carries_the_cloth_and_is_stored_in_every_frame() -> None:
    lift = BALL | {"position": [0.0, -0.11, 0.0], "velocity": [0.0, 0.5, 0.0], "stop": 0.2}
    made = sample(
        colliders=[lift, {"shape": "box", "size": [0.1, 0.1, 0.1], "position": [1, 0, 0]}],
        sequence={"duration": 0.3},
    )
    assert made.obstacle_vertices is not None
    assert made.obstacle_vertices.shape == (10, 162 + 8, 3)
    rise = np.diff(made.obstacle_vertices[:, 0, 1])
    np.testing.assert_allclose(rise, [0.5 / 30.0] * 6 + [0.0] * 3, atol=1e-6)
    np.testing.assert_array_equal(made.obstacle_vertices[0, 162:], made.obstacle_vertices[-1, 162:])
    assert made.positions[-1, :, 1].max() > 0.08, "lifted"


def test_colliders_that_stand_still_are_stored_once() -> None:
    made = sample(colliders=[BALL | {"position": [0.0, -0.2, 0.0]}], sequence={"duration": 0.1})
    assert made.obstacle_vertices is not None
    assert made.obstacle_vertices.shape == (1, 162, 3)


def test_wind_blows_a_hanging_sheet_out() -> None:
    scene = {"garment": STANDING, "pins": [{"side": "top"}], "solver": {"settle_steps": 60}}
    still, blown = (sample(**scene, **air) for air in ({}, {"air": {"wind": [0.0, 0.0, 4.0]}}))
    assert still.kind == blown.kind == "drape"
    assert abs(still.positions[0, :, 2]).max() < 1e-3
    assert blown.positions[0, :, 2].max() > 0.05


def test_sheets_rest_on_each_other_each_of_its_own_fabric() -> None:
    layer = SHEET | {"fabric": "11oz-black-denim", "position": [0.0, 0.01, 0.0]}
    layer |= {"repeat": {"count": [1, 2, 1], "step": [0.0, 0.01, 0.0]}}
    made = sample(
        layers=[layer], colliders=[BALL | {"position": [0.0, -0.105, 0.0]}], solver={"settle_steps": 30}
    )
    assert made.fabric == "gray-interlock+11oz-black-denim"
    assert made.garment.panel_names == ("sheet-0.sheet", "sheet-1.sheet", "sheet-2.sheet")
    lower, middle, upper = np.split(made.positions[0], 3)
    assert lower[:, 1].mean() < middle[:, 1].mean() < upper[:, 1].mean()
    assert made.positions[0, :, 1].max() < 0.05


def test_a_spent_budget_ends_with_frame_element_and_last_good_state() -> None:
    scene = parse_scene(
        {
            "name": "world",
            "garment": SHEET,
            "colliders": [BALL | {"position": [0.0, -0.105, 0.0]}],
            "sequence": {"duration": 0.2},
            "solver": {"max_work": 3},
        }
    )
    with pytest.raises(SimulationError) as error:
        simulate(scene)
    for part in ("scene world, frame 1:", "budget", "cloth [", "collider [", "max_work"):
        assert part in str(error.value)
    state = error.value.state
    assert state is not None
    assert np.isfinite(state.positions).all()
    assert state.positions.shape == state.velocity.shape
    assert state.collider_vertices.shape == (162, 3)


@pytest.mark.parametrize(
    ("values", "says"),
    [
        (
            {"colliders": [BALL]},
            r"scene world: the cloth begins with [1-9]\d* intersections with colliders and 0",
        ),
        (
            {"layers": [SHEET | {"rotation": [0.5, 0, 0]}], "sequence": {"duration": 1}},
            r"0 intersections .* and [1-9]",
        ),
        ({"garment": {"edge_length": 0.1}, "colliders": [BALL]}, r'has 4 panels.*design = "sheet"'),
        ({"pins": [{"side": "top", "layer": 1}]}, r"pins\.0\.layer = 1"),
        ({"colliders": [{"shape": "mesh", "file": "none.obj"}]}, "none.obj.*does not exist"),
    ],
)
def test_worlds_that_cannot_be(values: dict[str, Any], says: str) -> None:
    with pytest.raises(InputError, match=says):
        simulate(parse_scene({"name": "world", "garment": SHEET} | values))
