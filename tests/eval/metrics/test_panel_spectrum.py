"""Fourier bands of panels: Parseval, waves in their bands on any cut, leakage, smoothing as lost energy."""

import numpy as np
import pytest
from scipy.sparse import diags_array
from scipy.sparse.linalg import splu

from muslin.eval.metrics.laplace_beltrami import harmonic_basis
from muslin.eval.metrics.panel_spectrum import PANEL_BAND_EDGES, panel_energies, panel_images
from muslin.eval.metrics.spectrum import curvature_normals, spectrum_score
from muslin.garments.errors import InputError
from tests.eval.metrics.shapes import lifted, rolled, sheet, turned

UV, FACES = sheet(0.6, 0.5, 60, 50, "oriented")
ONE = np.zeros(len(FACES), dtype=int)
IMAGES = panel_images(FACES, UV[FACES], ONE)


def wave(points: np.ndarray, wavelength: float, degrees: float = 0.0) -> np.ndarray:
    along = points @ [np.cos(np.radians(degrees)), np.sin(np.radians(degrees))]
    return np.sin(2.0 * np.pi * along / wavelength)[:, None]


def round_cut() -> tuple[np.ndarray, np.ndarray]:
    """The faces of the sheet within an ellipse, and their vertices."""
    middle = UV[FACES].mean(axis=1)
    return FACES[((middle - [0.3, 0.25]) ** 2 @ [1 / 0.28**2, 1 / 0.23**2]) < 1.0], UV


@pytest.mark.parametrize("spacing", [0.01, 0.0095, 0.013, 0.0142, 0.021])
def test_bands_add_up_to_the_mean_square_in_the_window(spacing):
    values = np.random.default_rng(0).normal(size=(3, len(UV), 2))
    images = panel_images(FACES, UV[FACES], ONE, spacing)
    (image,) = images
    drawn = np.stack([image.sampling @ frame for frame in values])
    expected = np.square(drawn).sum(axis=(1, 2)) / np.square(image.window).sum()
    found = panel_energies(images, values)
    assert found.shape == (3, len(PANEL_BAND_EDGES) + 1)
    assert found.sum(axis=1) == pytest.approx(expected, rel=1e-12)
    assert panel_energies(images, values[1]) == pytest.approx(found[1])


def test_image_of_a_linear_function_is_that_function_in_the_window():
    (image,) = IMAGES
    ny, nx = image.window.shape
    x = UV[:, 0].min() + (np.arange(nx) - 0.5) * image.spacing
    drawn = (image.sampling @ UV[:, 0]).reshape(ny, nx)
    assert drawn == pytest.approx(image.window * x, abs=1e-12)
    assert image.window.max() == 1.0
    assert (image.sampling @ np.ones(len(UV))).reshape(ny, nx) == pytest.approx(image.window)


@pytest.mark.parametrize("degrees", [0.0, 37.0, 90.0])
@pytest.mark.parametrize(
    ("wavelength", "band", "share"), [(0.27, 1, 0.6), (0.14, 2, 0.9), (0.07, 3, 0.97), (0.04, 4, 0.98)]
)
def test_wave_lands_in_its_band_in_any_direction_on_any_cut(wavelength, band, share, degrees):
    faces, points = round_cut()
    cut = panel_images(faces, points[faces], np.zeros(len(faces), dtype=int))
    for images in (IMAGES, cut):
        values = wave(UV, wavelength, degrees)[: images[0].sampling.shape[1]]
        found = panel_energies(images, values)
        assert found[band] > share * found.sum()
        assert found.sum() == pytest.approx(0.5, rel=0.3)


def test_leakage_of_the_taper_against_a_sharp_cut():
    # A shape as large as the panel must not look like wrinkles.
    broad = np.ones((len(UV), 1)) + wave(UV, 0.9, 20.0)
    faded = panel_energies(IMAGES, broad)
    sharp = panel_energies(panel_images(FACES, UV[FACES], ONE, taper=0.0), broad)
    assert faded[3:].sum() < 1e-3 * faded.sum()
    assert sharp[3:].sum() > 25.0 * faded[3:].sum()


def test_smoothing_loses_short_waves_and_rigid_motion_nothing():
    basis = harmonic_basis(FACES, UV[FACES], 0.1)
    base, heights = rolled(UV, 0.3), 5e-4 * (wave(UV, 0.08) + wave(UV, 0.045, 90.0))

    def energies(z: np.ndarray) -> np.ndarray:
        return panel_energies(IMAGES, curvature_normals(basis, turned(base + z * [0.0, 0.0, 1.0])))

    truth = energies(heights)
    assert panel_energies(
        IMAGES, curvature_normals(basis, base + heights * [0.0, 0.0, 1.0])
    ) == pytest.approx(truth)
    scores = []
    for amount in (0.0, 1e-5, 5e-5, 2e-4, 1e-3):
        smooth = splu((diags_array(basis.mass) + amount * basis.stiffness).tocsc())
        z = smooth.solve(basis.mass[:, None] * heights)
        assert np.abs(z - heights).mean() < 1e-3
        scores.append(spectrum_score(energies(z), truth, band_edges=PANEL_BAND_EDGES))
    assert scores[0].wrinkles_kept == pytest.approx(1.0)
    assert (np.diff([score.wrinkles_kept for score in scores]) < 0.0).all()
    assert scores[-1].wrinkles_kept < 0.1
    # the shorter of the two waves goes first
    assert scores[1].kept[4] < scores[1].kept[3] < 1.0


def test_several_panels_add_up():
    two = np.concatenate([UV, UV + np.array([1.0, 0.0])])
    faces = np.concatenate([FACES, FACES + len(UV)])
    both = panel_images(faces, two[faces], np.repeat([0, 1], len(FACES)))
    one, other = wave(UV, 0.14), wave(UV, 0.07)
    mean = 0.5 * (panel_energies(IMAGES, one) + panel_energies(IMAGES, other))
    assert panel_energies(both, np.concatenate([one, other])) == pytest.approx(mean)


@pytest.mark.parametrize(
    "call",
    [
        lambda: panel_images(FACES, UV[FACES][:-1], ONE),
        lambda: panel_images(FACES, UV[FACES], ONE[:-1]),
        lambda: panel_images(FACES, np.full_like(UV[FACES], np.nan), ONE),
        lambda: panel_images(FACES, UV[FACES], ONE, spacing=0.0),
        lambda: panel_images(FACES, 1000.0 * UV[FACES], ONE),
        lambda: panel_energies(IMAGES, np.zeros((4, 3))),
        lambda: panel_energies(IMAGES, np.full((len(UV), 3), np.nan)),
        lambda: panel_energies(IMAGES, lifted(UV), (0.1, 0.2)),
        lambda: panel_energies(IMAGES, lifted(UV), (0.1, 0.01)),
    ],
)
def test_bad_input_is_named(call):
    with pytest.raises(InputError):
        call()
