"""Fabrics of one's own: the shipped table read as a file, short forms, and what is said of wrong ones."""

from __future__ import annotations

from importlib import resources
from pathlib import Path

import numpy as np
import pytest

from muslin.garments.errors import InputError
from muslin.sim.fabric_file import read_fabric
from muslin.sim.material import Fabric, fabric_names, isotropic_fabric, load_fabric

SHORT = """
[tin]
density = 0.3
stretch_rest = [100.0, 20.0, 200.0, 30.0]
bend = [[1e-5, 1e-5, 1e-5, 1e-5, 1e-5]]
"""


def same(a: Fabric, b: Fabric) -> None:
    assert a.density == b.density
    for key in ("stretch_rest", "stretch_strained", "bend"):
        np.testing.assert_allclose(getattr(a, key), getattr(b, key), rtol=1e-12)


@pytest.fixture
def file(tmp_path: Path):
    def write(text: str) -> str:
        (tmp_path / "mine.toml").write_text(text, encoding="utf-8")
        return str(tmp_path / "mine.toml")

    return write


def test_the_table_that_ships_is_such_a_file() -> None:
    with resources.as_file(resources.files("muslin.sim") / "assets" / "wang2011_fabrics.toml") as path:
        for name in fabric_names():
            same(read_fabric(f"{path}:{name}"), load_fabric(name))


def test_short_forms_stand_for_every_direction_and_strain(file) -> None:
    fabric = read_fabric(file(SHORT))
    assert fabric.name == "tin"
    np.testing.assert_array_equal(fabric.stretch_strained, np.tile(fabric.stretch_rest, (5, 1)))
    np.testing.assert_array_equal(fabric.bend, np.full((3, 5), 1e-5))


def test_an_isotropic_sheet_as_a_file(file) -> None:
    young, poisson, h = 1.0e6, 0.3, 5.0e-4
    c11 = young * h / (2.0 * (1.0 - poisson**2))
    bend = 4.0 * young * h**3 / (12.0 * (1.0 - poisson**2))
    text = f"""
    [paper]
    density = 0.1
    stretch_rest = [{c11!r}, {poisson * c11!r}, {c11!r}, {young * h / (1.0 + poisson)!r}]
    bend = [[{", ".join([repr(bend)] * 5)}]]
    """
    same(read_fabric(file(text)), isotropic_fabric(young, poisson, h, 0.1))


@pytest.mark.parametrize(
    ("change", "says"),
    [
        (("density = 0.3", "density = -0.3"), ["mine.toml:tin", "density = -0.3", "greater than 0"]),
        (("density = 0.3", ""), ["density is missing"]),
        (("density", "weight"), ["density is missing"]),
        (("[tin]", "[tin]\nweight = 3"), ["unknown key weight", "stretch_rest"]),
        (("30.0]", "30.0, 4.0]"), ["stretch_rest"]),
        (("20.0", "nan"), ["stretch_rest.1", "finite"]),
        (("bend = [[1e-5", "bend = [[-1e-5"), ["bend.0.0 = -1e-05"]),
        (("bend = [", "bend = [[1, 1, 1, 1, 1], "), ["bend has 2 rows", "3"]),
        (("[tin]", "[tin"), ["not TOML"]),
        (("[tin]", "[zinc]\n[tin]"), ["choose one of tin, zinc", "mine.toml:NAME"]),
    ],
)
def test_fabric_files_that_cannot_be(file, change: tuple[str, str], says: list[str]) -> None:
    path = file(SHORT.replace(*change))
    with pytest.raises(InputError) as error:
        read_fabric(path)
    for part in says:
        assert part in str(error.value)
    assert "\n" not in str(error.value)


def test_a_missing_file_and_a_missing_fabric(file) -> None:
    with pytest.raises(InputError, match=r"none\.toml: not readable"):
        read_fabric("none.toml")
    with pytest.raises(InputError, match="choose one of tin"):
        read_fabric(file(SHORT) + ":lead")
