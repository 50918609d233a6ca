"""Spectrum of the curvature of cloth over Laplace-Beltrami eigenfunctions: which waves a prediction keeps."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from muslin.eval.metrics.checks import checked_points
from muslin.eval.metrics.laplace_beltrami import HarmonicBasis
from muslin.garments.errors import InputError

BAND_EDGES = (0.4, 0.2, 0.1)
"""Wavelengths between bands, metres, falling: longer than the first, ..., shorter than the last."""
CUT_OFF = 0.1
"""Wavelength below which shape counts as wrinkles, metres."""
ROUNDING = 1e-4
"""Mean square curvature, 1/m^2, of a radius of 100 m: what float32 positions of fine meshes have flat."""


@dataclass(frozen=True)
class SpectrumScore:
    """A prediction's share of the truth's curvature, wavelength by wavelength.

    band_edges   wavelengths between the bands, metres, falling; one band more than edges
    prediction   root mean square of |2 H| in each band, 1/m
    truth        the same of the truth
    kept         energy of the prediction over that of the truth in each band: 1 is right, 0 is smoothed away,
                 more than 1 is noise; None where the truth has nothing above rounding
    error        energy of the difference over that of the truth in each band: 0 is right, 1 is as good as
                 nothing, 2 is right in size and elsewhere; None where the truth has nothing, or without a
                 difference
    wrinkles_kept, wrinkles_error   the same of all bands below the cut-off together
    log_spectral_distance           see `log_spectral_distance`, dB
    """

    band_edges: tuple[float, ...]
    prediction: tuple[float, ...]
    truth: tuple[float, ...]
    kept: tuple[float | None, ...]
    error: tuple[float | None, ...]
    wrinkles_kept: float | None
    wrinkles_error: float | None
    log_spectral_distance: float


def curvature_normals(basis: HarmonicBasis, positions: np.ndarray) -> np.ndarray:
    """Mean curvature normals 2 H n of cloth in its rest metric; (..., V, 3), 1/m.

        h = -Laplace x,   h_i = (K x)_i / M_ii inside, the mean of inner neighbours on the boundary,

    K and M of the basis. The coordinates x themselves have no useful spectrum: cloth that lies flat is a
    linear function, which is no wave that ends with slope 0 at a hem, and its energy falls only as the fourth
    power of the wavelength: a flat sheet of 0.8 m has 2.3 mm (root mean square) below 0.1 m, as much as its
    wrinkles would. h is zero for any flat, evenly stretched cloth, and 4 pi^2 / wavelength^2 times the height
    of a wave. Rigid motions turn h and keep its size.

    positions (..., V, 3), metres. Raises InputError unless they are finite and fit the basis.
    """
    x = checked_points(positions, "spectrum")
    count = len(basis.mass)
    if x.shape[-2] != count:
        raise InputError(
            f"spectrum: positions of shape {positions.shape} for a basis of {count} vertices; make the basis "
            "of the faces that the positions have"
        )
    columns = np.moveaxis(x, -2, 0).reshape(count, -1)
    normals = basis.laplacian @ (columns - columns.mean(axis=0))
    return np.moveaxis(normals.reshape(count, *x.shape[:-2], 3), 0, -2)


def band_energies(
    basis: HarmonicBasis,
    values: np.ndarray,
    band_edges: tuple[float, ...] = BAND_EDGES,
) -> np.ndarray:
    """Mean square of values over the surface, wavelength band by band; (..., B), their unit squared.

        E_b = 1/A sum over lambda_i of band b of |c_i|^2,  c_i = phi_i . M x

    and the last band holds what is left, x . M x / A - sum_b E_b (Parseval), so all together are the mean
    square of x about its mean: nothing is cut off where the basis ends. Constants belong to no band.

    values       (..., V, d): `curvature_normals` of positions, or prediction minus truth: of these, or of
                 positions, whose energies say at which wavelengths the vertex error lies, m^2
    band_edges   metres, falling; none shorter than the basis reaches
    """
    edges = np.asarray(band_edges, dtype=np.float64)
    if len(edges) == 0 or (np.diff(edges) >= 0).any() or edges[-1] < basis.shortest * (1.0 - 1e-9):
        raise InputError(
            f"spectrum: band edges {band_edges} m are not allowed; give falling wavelengths, none below "
            f"{basis.shortest} m, the shortest of the basis"
        )
    energies = np.square(basis.coefficients(values)).sum(axis=-1)
    total = np.square(values).sum(axis=-1) @ basis.mass - energies[..., : basis.component_count].sum(axis=-1)
    band = np.searchsorted(-edges, -basis.wavelengths, side="right")
    band[: basis.component_count] = -1
    found = [energies[..., band == b].sum(axis=-1) for b in range(len(edges))]
    found.append(np.maximum(total - np.sum(found, axis=0), 0.0))
    return np.stack(found, axis=-1) / basis.area


def spectrum_score(
    prediction: np.ndarray,
    truth: np.ndarray,
    difference: np.ndarray | None = None,
    band_edges: tuple[float, ...] = BAND_EDGES,
    cut_off: float = CUT_OFF,
) -> SpectrumScore:
    """Score of `band_energies` (B,) of curvature normals, of a frame or their mean over frames, 1/m^2.

    `cut_off` is one of `band_edges`; `difference` the energies of prediction minus truth. Raises InputError
    for energies that do not fit the bands or are negative or not finite.
    """
    sides = [prediction, truth] + ([] if difference is None else [difference])
    if any(side.shape != (len(band_edges) + 1,) for side in sides):
        raise InputError(
            f"spectrum: energies of shapes {[side.shape for side in sides]} are not allowed; "
            f"{len(band_edges)} band edges make ({len(band_edges) + 1},)"
        )
    if any(not np.isfinite(side).all() or (side < 0.0).any() for side in sides):
        raise InputError("spectrum: energies must be finite and not negative")
    if cut_off not in band_edges:
        raise InputError(f"spectrum: cut_off = {cut_off} m is not allowed; choose one of {band_edges}")
    short = slice(band_edges.index(cut_off) + 1, None)
    return SpectrumScore(
        band_edges=tuple(band_edges),
        prediction=tuple(np.sqrt(prediction).tolist()),
        truth=tuple(np.sqrt(truth).tolist()),
        kept=tuple(_share(p, t) for p, t in zip(prediction, truth, strict=True)),
        error=(None,) * len(truth)
        if difference is None
        else tuple(_share(d, t) for d, t in zip(difference, truth, strict=True)),
        wrinkles_kept=_share(prediction[short].sum(), truth[short].sum()),
        wrinkles_error=None if difference is None else _share(difference[short].sum(), truth[short].sum()),
        log_spectral_distance=log_spectral_distance(prediction, truth),
    )


def log_spectral_distance(prediction: np.ndarray, truth: np.ndarray) -> float:
    """sqrt( mean over bands of (10 log10 (E_b / E'_b))^2 ), dB: 3 dB is twice or half the energy throughout.

    Energies (B,), 1/m^2; each counts as ROUNDING at least, so bands with nothing in them are alike.
    Source: Gray, Markel 1976 (of spectra of speech).
    """
    decibels = 10.0 * np.log10(np.maximum(prediction, ROUNDING) / np.maximum(truth, ROUNDING))
    return float(np.sqrt(np.mean(decibels**2)))


def _share(energy: float, of: float) -> float | None:
    return float(energy / of) if of > ROUNDING else None
