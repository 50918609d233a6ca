"""Fabrics: what every table has to satisfy, and the isotropic sheet against plane stress and plate theory."""

from __future__ import annotations

import tomllib
from importlib import resources
from itertools import pairwise

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.integrate import quad

from muslin.garments.errors import InputError
from muslin.sim.material import Fabric, bend_moments, fabric_names, isotropic_fabric, load_fabric

NAMES = fabric_names()
TABLE_FILE = resources.files("muslin.sim").joinpath("assets/wang2011_fabrics.toml")
TABLE = tomllib.loads(TABLE_FILE.read_text(encoding="utf-8"))


def tensor(c: NDArray[np.float64]) -> NDArray[np.float64]:
    """Stress (s11, s22, s12) per strain (G11, G22, G12) of coefficients [c11, c12, c22, c33]."""
    return np.array([[2 * c[0], 2 * c[1], 0.0], [2 * c[1], 2 * c[2], 0.0], [0.0, 0.0, c[3]]])


def test_there_are_the_ten_fabrics_of_the_paper() -> None:
    assert len(NAMES) == 10
    assert sorted(TABLE) == NAMES


@pytest.mark.parametrize("name", NAMES)
def test_shapes_and_signs(name: str) -> None:
    fabric = load_fabric(name)
    assert fabric.name == name
    assert 0.05 < fabric.density < 0.5
    assert fabric.stretch_rest.shape == (4,)
    assert fabric.stretch_strained.shape == (5, 4)
    assert fabric.bend.shape == (3, 5)
    assert (fabric.bend > 0.0).all()
    assert (fabric.stretch_rest[[0, 2, 3]] > 0.0).all()


@pytest.mark.parametrize("name", NAMES)
def test_table_is_changed_only_where_it_is_inadmissible(name: str) -> None:
    fabric = load_fabric(name)
    for key, found in (("stretch_rest", fabric.stretch_rest), ("stretch_strained", fabric.stretch_strained)):
        measured = np.array(TABLE[name][key])
        c11, c12, c22 = measured[..., 0], measured[..., 1], measured[..., 2]
        admissible = (measured >= 0.0).all(axis=-1) & (c12 <= 0.95 * np.sqrt(np.maximum(c11 * c22, 0.0)))
        np.testing.assert_array_equal(found[admissible], measured[admissible])
        np.testing.assert_array_equal(found[..., 3], np.maximum(measured[..., 3], 0.0))
    np.testing.assert_array_equal(fabric.bend, np.array(TABLE[name]["bend"]))
    assert fabric.density == TABLE[name]["density"]


@pytest.mark.parametrize("name", NAMES)
def test_every_interpolated_tensor_is_positive_semi_definite(name: str) -> None:
    fabric = load_fabric(name)
    for row in range(4):
        for w in np.linspace(0.0, 1.0, 5):
            strained = (1 - w) * fabric.stretch_strained[row] + w * fabric.stretch_strained[row + 1]
            for t in np.linspace(0.0, 1.0, 5):
                eigenvalues = np.linalg.eigvalsh(tensor((1 - t) * fabric.stretch_rest + t * strained))
                assert eigenvalues[0] >= -1e-12 * eigenvalues[-1]


def test_unknown_fabric_is_told_the_known_ones() -> None:
    with pytest.raises(InputError, match=r"'velvet'.*gray-interlock"):
        load_fabric("velvet")


def test_scaling_multiplies_and_leaves_the_original() -> None:
    fabric = load_fabric("gray-interlock")
    before = fabric.stretch_rest.copy()
    scaled = fabric.scaled(density=2.0, stretch=3.0, bend=0.25)
    assert scaled.density == 2.0 * fabric.density
    np.testing.assert_array_equal(scaled.stretch_rest, 3.0 * fabric.stretch_rest)
    np.testing.assert_array_equal(scaled.stretch_strained, 3.0 * fabric.stretch_strained)
    np.testing.assert_array_equal(scaled.bend, 0.25 * fabric.bend)
    np.testing.assert_array_equal(fabric.stretch_rest, before)


@pytest.mark.parametrize("key", ["density", "stretch", "bend"])
@pytest.mark.parametrize("value", [0.0, -1.0, float("nan"), float("inf")])
def test_multipliers_must_be_positive_and_finite(key: str, value: float) -> None:
    with pytest.raises(InputError, match=f"{key} = {value}"):
        load_fabric("gray-interlock").scaled(**{key: value})


def sheet(young: float = 2.0e6, poisson: float = 0.3, thickness: float = 4.0e-4) -> Fabric:
    return isotropic_fabric(young, poisson, thickness, 0.2)


@pytest.mark.parametrize("poisson", [-0.5, 0.0, 0.3, 0.5])
def test_isotropic_tensor_has_young_modulus_poisson_ratio_and_shear_modulus(poisson: float) -> None:
    young, thickness = 2.0e6, 4.0e-4
    stiffness = tensor(sheet(young, poisson, thickness).stretch_rest)
    # A uniaxial stress of one: strain 1 / (E h) along, -nu / (E h) across, no shear.
    strain = np.linalg.solve(stiffness, [1.0, 0.0, 0.0])
    np.testing.assert_allclose(strain, np.array([1.0, -poisson, 0.0]) / (young * thickness), atol=1e-18)
    # s12 = 2 mu h G12 with mu = E / (2 (1 + nu))
    assert stiffness[2, 2] == pytest.approx(2.0 * thickness * young / (2.0 * (1.0 + poisson)))


@pytest.mark.parametrize("poisson", [-0.5, 0.0, 0.3, 0.5])
def test_isotropic_energy_does_not_depend_on_direction(poisson: float) -> None:
    c11, c12, c22, c33 = sheet(poisson=poisson).stretch_rest
    strain = np.array([[0.1, 0.03], [0.03, -0.04]])

    def energy(angle: float) -> float:
        c, s = np.cos(angle), np.sin(angle)
        g = np.array([[c, -s], [s, c]]) @ strain @ np.array([[c, s], [-s, c]])
        return c11 * g[0, 0] ** 2 + 2 * c12 * g[0, 0] * g[1, 1] + c22 * g[1, 1] ** 2 + c33 * g[0, 1] ** 2

    energies = [energy(angle) for angle in np.linspace(0.0, np.pi, 13)]
    np.testing.assert_allclose(energies, energies[0], rtol=1e-12)


def test_isotropic_tables_are_flat_and_hold_the_plate_rigidity() -> None:
    fabric = sheet()
    np.testing.assert_array_equal(fabric.stretch_strained, np.tile(fabric.stretch_rest, (5, 1)))
    rigidity = 2.0e6 * 4.0e-4**3 / (12.0 * (1.0 - 0.3**2))
    np.testing.assert_allclose(fabric.bend, 4.0 * rigidity, rtol=1e-14)


@pytest.mark.parametrize(
    ("key", "value"),
    [("young", 0.0), ("thickness", -1.0), ("density", float("nan")), ("poisson", -1.0), ("poisson", 0.51)],
)
def test_isotropic_sheet_refuses_what_is_not_a_material(key: str, value: float) -> None:
    arguments = {"young": 1.0e6, "poisson": 0.3, "thickness": 1.0e-3, "density": 0.2} | {key: value}
    with pytest.raises(InputError, match=f"{key} = {value}"):
        isotropic_fabric(**arguments)


@pytest.mark.parametrize("name", NAMES)
def test_rigidities_give_back_the_hinge_table(name: str) -> None:
    fabric = load_fabric(name)
    d11, d12, d22, d66 = fabric.rigidity.T
    np.testing.assert_allclose(d22, fabric.bend[0] / 4.0, rtol=1e-12)
    np.testing.assert_allclose((d11 + d22 + 2.0 * d12 + 4.0 * d66) / 4.0, fabric.bend[1] / 4.0, rtol=1e-12)
    np.testing.assert_allclose(d11, fabric.bend[2] / 4.0, rtol=1e-12)


@pytest.mark.parametrize("name", NAMES)
def test_bending_is_positive_semi_definite_at_every_curvature(name: str) -> None:
    d11, d12, d22, d66 = load_fabric(name).rigidity.T
    assert (d66 >= 0.0).all()
    assert (d11 * d22 - d12**2 >= 0.0).all()


@pytest.mark.parametrize("poisson", [-0.5, 0.0, 0.3, 0.5])
def test_isotropic_rigidities_are_the_plates(poisson: float) -> None:
    rigidity = 2.0e6 * 4.0e-4**3 / (12.0 * (1.0 - poisson**2))
    expected = rigidity * np.array([1.0, poisson, 1.0, 0.5 * (1.0 - poisson)])
    np.testing.assert_allclose(sheet(poisson=poisson).rigidity, np.tile(expected, (5, 1)), rtol=1e-12)


def test_scaling_bending_keeps_poissons_ratio() -> None:
    np.testing.assert_allclose(sheet().scaled(bend=3.0).rigidity, 3.0 * sheet().rigidity, rtol=1e-14)


@pytest.mark.parametrize("name", NAMES)
def test_bend_moments_are_the_integrals_of_the_rigidities(name: str) -> None:
    rigidity = load_fabric(name).rigidity
    curvatures = np.array([0.0, 10.0, 20.0, 30.0, 40.0])
    for d, moment in zip(rigidity.T, bend_moments(rigidity).T, strict=True):
        pieces = [
            quad(lambda k, d=d: np.interp(k, curvatures, d) * k, low, high)[0]
            for low, high in pairwise(curvatures)
        ]
        np.testing.assert_allclose(moment, np.concatenate([[0.0], np.cumsum(pieces)]), rtol=1e-12, atol=1e-18)
