"""Pins: which vertices they name, where they lead them, when they let go."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from muslin.garments.errors import InputError
from muslin.garments.mesh import GarmentMesh
from muslin.sim.world.pins import Pins
from muslin.sim.world.placing import lay_flat
from muslin.sim.world.tables import PinTable

GridMesh = Callable[[int, int, float], GarmentMesh]


@pytest.fixture
def sheet(grid_mesh: GridMesh) -> GarmentMesh:
    """4 x 3 squares of 0.1 m, x from -0.2 to 0.2, y from -0.3 to 0."""
    return grid_mesh(4, 3, 0.1)


def pins(mesh: GarmentMesh, *values: dict[str, Any], count: int = 1) -> Pins:
    start = np.concatenate([lay_flat(mesh, (0.0, 0.5 * k, 0.0), (0.0, 0.0, 0.0)) for k in range(count)])
    return Pins([PinTable.model_validate(value) for value in values], [mesh] * count, start)


@pytest.mark.parametrize(
    ("side", "axis", "value"), [("left", 0, -0.2), ("right", 0, 0.2), ("bottom", 1, -0.3), ("top", 1, 0.0)]
)
def test_a_side_is_all_of_the_side(sheet: GarmentMesh, side: str, axis: int, value: float) -> None:
    held, targets = pins(sheet, {"side": side}).at(3.0)
    np.testing.assert_array_equal(held, np.isclose(sheet.panel_vertices[:, axis], value))
    np.testing.assert_array_equal(targets, lay_flat(sheet, (0.0, 0.0, 0.0), (0.0, 0.0, 0.0)))


def test_a_box_holds_what_lies_in_it_on_the_garment_it_names(sheet: GarmentMesh) -> None:
    held, _ = pins(sheet, {"box": [[-0.2, -0.1], [-0.05, 0.0]], "layer": 1}, count=3).at(0.0)
    x, y = sheet.panel_vertices.T
    n = len(x)
    np.testing.assert_array_equal(held[n : 2 * n], (x < -0.05) & (y > -0.15))
    assert not held[:n].any()
    assert not held[2 * n :].any()


def test_handles_spin_about_their_middle_and_let_go(sheet: GarmentMesh) -> None:
    made = pins(
        sheet, {"side": "top", "spin": [0.0, np.pi, 0.0], "velocity": [0.0, 1.0, 0.0], "release": 1.0}
    )
    held, targets = made.at(1.0)
    there, began = targets[held], lay_flat(sheet, (0.0, 0.0, 0.0), (0.0, 0.0, 0.0))[held]
    np.testing.assert_allclose(there, began * [-1.0, 0.0, 1.0] + [0.0, 1.0, 0.0], atol=1e-12)
    assert not made.at(1.0 + 1.0 / 60.0)[0].any()


def test_the_last_pin_that_holds_a_vertex_leads_it(sheet: GarmentMesh) -> None:
    first = {"side": "top", "velocity": [1.0, 0.0, 0.0]}
    then = {"side": "left", "velocity": [0.0, 0.0, 1.0], "release": 1.0}
    made = pins(sheet, first, then)
    x, y = sheet.panel_vertices.T
    corner = int(np.flatnonzero(np.isclose(x, -0.2) & np.isclose(y, 0.0))[0])
    np.testing.assert_allclose(made.at(1.0)[1][corner], [-0.2, 0.0, 1.0], atol=1e-12)
    np.testing.assert_allclose(made.at(2.0)[1][corner], [1.8, 0.0, 0.0], atol=1e-12)


@pytest.mark.parametrize(
    ("values", "says"),
    [
        ({"side": "top", "layer": 2}, r"pins\.0\.layer = 2.*1 garments.*give 0 to 0"),
        ({"box": [[0.01, 0.01], [0.02, 0.02]]}, r"pins\.0\.box = .*no vertex.*-0\.2, -0\.3.*larger"),
    ],
)
def test_pins_that_hold_nothing(sheet: GarmentMesh, values: dict[str, Any], says: str) -> None:
    with pytest.raises(InputError, match=says):
        pins(sheet, values)
