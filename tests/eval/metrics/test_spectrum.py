"""Laplace-Beltrami spectrum: known eigenvalues, Parseval, waves in their bands, smoothing as lost energy."""

import numpy as np
import pytest
from scipy.linalg import eigh
from scipy.sparse import diags_array
from scipy.sparse.linalg import splu

from muslin.eval.metrics.laplace_beltrami import DENSE, SLICE, harmonic_basis
from muslin.eval.metrics.spectrum import (
    band_energies,
    curvature_normals,
    log_spectral_distance,
    spectrum_score,
)
from muslin.eval.metrics.vertex import vertex_errors
from muslin.garments.errors import InputError
from tests.eval.metrics.shapes import lifted, rolled, sheet, sphere, turned

SIDE = 0.8
UV, FACES = sheet(SIDE, SIDE, 40, 40, "oriented")
BASIS = harmonic_basis(FACES, UV[FACES])


def energies(x: np.ndarray) -> np.ndarray:
    return band_energies(BASIS, curvature_normals(BASIS, x))


def wave(wavelength: float, height: float, x: np.ndarray) -> np.ndarray:
    return height * np.cos(2.0 * np.pi * x / wavelength)


def test_eigenvalues_of_a_square_converge_to_its_waves():
    m, n = np.meshgrid(np.arange(6), np.arange(6))
    exact = np.sort(((np.pi / SIDE) ** 2 * (m**2 + n**2)).ravel())[:15]
    errors = []
    for cells in (16, 32):
        uv, faces = sheet(SIDE, SIDE, cells, cells)
        errors.append(np.abs(harmonic_basis(faces, uv[faces], 0.2).eigenvalues[:15] - exact).max())
    assert errors[0] / errors[1] == pytest.approx(4.0, rel=0.15)
    assert errors[1] < 0.01 * exact[-1]


def test_eigenvalues_of_a_sphere_come_in_their_multiplicities():
    x, faces = sphere(3, 1.0)
    found = harmonic_basis(faces, x[faces], 2.0 * np.pi / np.sqrt(25.0)).eigenvalues
    exact = np.concatenate([np.full(2 * k + 1, k * (k + 1)) for k in range(5)])
    assert found == pytest.approx(exact, rel=0.03, abs=1e-9)


def test_sliced_basis_misses_nothing_and_is_orthonormal():
    uv, faces = sheet(SIDE, SIDE, 27, 27)
    basis = harmonic_basis(faces, uv[faces])
    assert len(uv) > DENSE
    root = np.sqrt(basis.mass)
    dense = eigh(basis.stiffness.toarray() / np.outer(root, root), eigvals_only=True)
    below = dense[dense < (2.0 * np.pi / basis.shortest) ** 2]
    assert len(below) > 3 * SLICE
    assert basis.eigenvalues == pytest.approx(below, rel=1e-9, abs=1e-9)
    gram = basis.functions.T @ (basis.mass[:, None] * basis.functions)
    assert gram == pytest.approx(np.eye(len(gram)), abs=1e-9)
    assert basis.area == pytest.approx(SIDE**2)


def test_parseval_to_rounding_on_a_basis_of_the_whole_mesh():
    uv, faces = sheet(0.3, 0.3, 9, 9, "irregular")
    whole = harmonic_basis(faces, uv[faces], 0.005)
    assert len(whole.eigenvalues) == len(uv)
    values = np.random.default_rng(0).normal(size=(4, len(uv), 3))
    squares = np.square(values).sum(axis=-1) @ whole.mass
    assert np.square(whole.coefficients(values)).sum(axis=(-1, -2)) == pytest.approx(squares, rel=1e-12)
    # and what a shorter basis leaves over is what its bands do not have
    part = harmonic_basis(faces, uv[faces], 0.1)
    by_part = band_energies(part, values, (0.2, 0.1))
    assert by_part == pytest.approx(band_energies(whole, values, (0.2, 0.1)), rel=1e-9)
    assert by_part[0] == pytest.approx(band_energies(part, values[0], (0.2, 0.1)))


@pytest.mark.parametrize(
    ("count", "band"), [(1, 0), (3, 0), (5, 1), (6, 1), (9, 2), (13, 2), (18, 3), (24, 3)]
)
def test_wave_lands_in_the_band_of_its_wavelength(count, band):
    wavelength = 2.0 * SIDE / count
    found = energies(lifted(UV, wave(wavelength, 1e-3, UV[:, 0])))
    assert found[band] > 0.97 * found.sum()
    if count < 10:  # where the mesh has ten vertices a wave and more
        assert found[band] == pytest.approx(0.5 * (1e-3 * (2.0 * np.pi / wavelength) ** 2) ** 2, rel=0.1)


def test_eigenfunction_as_error_is_in_its_band_alone():
    mode = int(np.searchsorted(-BASIS.wavelengths, -0.15))
    error = 1e-3 * BASIS.functions[:, [mode]] * np.array([0.6, 0.0, 0.8])
    assert band_energies(BASIS, error) * BASIS.area == pytest.approx([0.0, 0.0, 1e-6, 0.0], abs=1e-17)


def test_flat_and_evenly_stretched_cloth_has_no_spectrum_and_rigid_motion_none_of_its_own():
    assert energies(turned(lifted(UV * [1.2, 0.9]))).max() < 1e-18
    x = rolled(UV, 0.15) + lifted(0.0 * UV, wave(0.05, 1e-3, UV[:, 1]))
    assert energies(turned(x)) == pytest.approx(energies(x), rel=1e-9)
    frames = np.stack([x, turned(x), lifted(UV)])
    assert energies(frames)[1] == pytest.approx(energies(x))


def test_smoothing_loses_short_waves_while_the_vertex_error_stays_below_a_millimetre():
    wrinkles = wave(0.08, 0.7e-3, UV[:, 0]) + wave(0.06, 0.5e-3, UV[:, 1])
    base = rolled(UV, 0.3)
    truth = base + wrinkles[:, None] * np.array([0.0, 0.0, 1.0])
    true_energy = energies(truth)
    scores = []
    for amount in (0.0, 1e-5, 5e-5, 2e-4, 1e-3, 1e-2):
        smoothed = splu((diags_array(BASIS.mass) + amount * BASIS.stiffness).tocsc()).solve(
            BASIS.mass * wrinkles
        )
        x = base + smoothed[:, None] * np.array([0.0, 0.0, 1.0])
        assert vertex_errors(x, truth).mean() < 1e-3
        normals = [curvature_normals(BASIS, side) for side in (x, truth)]
        scores.append(spectrum_score(energies(x), true_energy, band_energies(BASIS, normals[0] - normals[1])))
    kept = [score.wrinkles_kept for score in scores]
    assert kept[0] == pytest.approx(1.0)
    assert (np.diff(kept) < 0.0).all()
    assert kept[-1] < 0.05
    assert scores[-1].kept[0] == pytest.approx(1.0, abs=0.05)  # the roll itself stays
    assert (np.diff([score.log_spectral_distance for score in scores]) > 0.0).all()
    assert (np.diff([score.wrinkles_error for score in scores]) > 0.0).all()
    assert scores[-1].wrinkles_error == pytest.approx(1.0, abs=0.05)


def test_noise_has_more_than_all_of_the_energy():
    truth = lifted(UV, wave(0.08, 1e-3, UV[:, 0]))
    noise = truth + 3e-4 * np.random.default_rng(0).normal(size=truth.shape)
    assert spectrum_score(energies(noise), energies(truth)).wrinkles_kept > 1.5


def test_score_where_the_truth_is_flat_and_the_decibels():
    flat = np.zeros(4)
    score = spectrum_score(flat, flat, flat)
    assert (score.kept, score.error, score.wrinkles_kept) == ((None,) * 4, (None,) * 4, None)
    assert score.log_spectral_distance == 0.0
    truth = np.array([4.0, 3.0, 2.0, 1.0])
    assert log_spectral_distance(2.0 * truth, truth) == pytest.approx(10.0 * np.log10(2.0))
    halved = spectrum_score(truth * [1, 1, 1, 0.25], truth)
    assert halved.prediction[3] == 0.5
    assert halved.kept == (1.0, 1.0, 1.0, 0.25)
    assert halved.wrinkles_kept == 0.25
    assert halved.log_spectral_distance == pytest.approx(10.0 * np.log10(4.0) / 2.0)


def test_basis_is_made_once_for_a_mesh_and_knows_its_pieces():
    # Not BASIS: others that were asked for since may have pushed it out of the cache.
    made = harmonic_basis(FACES, UV[FACES])
    assert harmonic_basis(FACES.copy(), UV[FACES].copy()) is made
    two = np.concatenate([UV, UV + np.array([1.0, 0.0])])
    faces = np.concatenate([FACES, FACES + len(UV)])
    both = harmonic_basis(faces, two[faces], 0.2)
    assert both.component_count == 2
    assert both.eigenvalues[:2] == pytest.approx([0.0, 0.0], abs=1e-9)
    apart = np.repeat([[1.0, 0, 0], [0, 5.0, 0]], len(UV), axis=0)
    assert band_energies(both, apart, (0.2,)).max() < 1e-12


LARGE_UV, LARGE_FACES = sheet(60.0, 60.0, 60, 60)  # metres
LARGE = LARGE_FACES, LARGE_UV[LARGE_FACES]


@pytest.mark.parametrize(
    "call",
    [
        lambda: harmonic_basis(FACES, UV[FACES][:-1]),
        lambda: harmonic_basis(FACES, np.full((len(FACES), 3, 2), np.nan)),
        lambda: harmonic_basis(FACES, np.zeros((len(FACES), 3, 2))),
        lambda: harmonic_basis(FACES[:0], UV[FACES][:0]),
        lambda: harmonic_basis(FACES + 1, UV[FACES], 0.2),
        lambda: harmonic_basis(FACES, UV[FACES], 0.0),
        lambda: harmonic_basis(*LARGE),
        lambda: curvature_normals(BASIS, np.zeros((5, 3))),
        lambda: curvature_normals(BASIS, np.full((len(UV), 3), np.inf)),
        lambda: band_energies(BASIS, lifted(UV), (0.1, 0.2)),
        lambda: band_energies(BASIS, lifted(UV), (0.1, 0.05)),
        lambda: spectrum_score(np.ones(3), np.ones(4)),
        lambda: spectrum_score(np.full(4, np.nan), np.ones(4)),
        lambda: spectrum_score(np.ones(4), np.ones(4), cut_off=0.15),
    ],
)
def test_bad_input_is_named(call):
    with pytest.raises(InputError):
        call()
