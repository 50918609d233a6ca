"""Spectrum over the panels: values on cloth drawn as images in panel space, and their Fourier bands."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import igl
import numpy as np
from scipy.fft import next_fast_len, rfft2
from scipy.ndimage import distance_transform_edt
from scipy.sparse import csr_array

from muslin.eval.metrics.checks import check_faces, checked_corners
from muslin.garments.errors import InputError
from muslin.garments.locate import barycentric

PANEL_BAND_EDGES = (0.4, 0.2, 0.1, 0.05)
"""Wavelengths between bands, metres, falling."""
SPACING = 0.01
"""Of pixels, metres: the shortest wave is twice as long."""
TAPER = 0.1
"""Width of the margin over which a panel fades, metres."""
MOST_PIXELS = 4_000_000  # of a panel; beyond, the units are wrong


@dataclass(frozen=True, eq=False)
class PanelImage:
    """How to draw values at the vertices of a garment as the image of one panel, faded at its margin.

    sampling   (ny nx, V): weights of the vertices in each pixel, times the window w of the pixel
    window     (ny, nx): w, 1 inside, 0 outside of the panel and at its boundary
    spacing    of the pixels, metres
    """

    sampling: csr_array
    window: np.ndarray
    spacing: float

    @cached_property
    def frequencies(self) -> tuple[np.ndarray, np.ndarray]:
        """|k|, 1/m, of the real transform's coefficients, and how often each stands in the whole one;
        (ny, nx // 2 + 1) each."""
        ny, nx = self.window.shape
        across = np.fft.rfftfreq(nx, self.spacing)
        size = np.hypot(np.fft.fftfreq(ny, self.spacing)[:, None], across)
        often = np.full(len(across), 2.0)
        often[0] = 1.0
        if nx % 2 == 0:
            often[-1] = 1.0
        return size, np.broadcast_to(often, size.shape)

    def power(self, columns: np.ndarray) -> np.ndarray:
        """|F(w (h - m))_k|^2 / N, counted as often as it stands in the whole transform, the mean m's energy
        m^2 sum w^2 at k = 0; (n, ny, nx // 2 + 1) of values (V, n)."""
        images = self.sampling @ columns
        window = self.window.ravel()
        mean = (window @ images) / np.square(window).sum()
        images -= window[:, None] * mean
        found = np.abs(rfft2(images.T.reshape(-1, *self.window.shape))) ** 2
        found *= self.frequencies[1] / self.window.size
        found[:, 0, 0] += np.square(mean) * np.square(window).sum()
        return found


def panel_images(
    faces: np.ndarray,
    panels: np.ndarray,
    face_panel: np.ndarray,
    spacing: float = SPACING,
    taper: float = TAPER,
) -> tuple[PanelImage, ...]:
    """Images of all panels of a garment, once for all frames of a topology.

    A pixel takes the value of the cloth at its middle, linear in its triangle. A panel is no rectangle, and
    cut out sharply it would spread the energy of every wave over all others. So it fades at its boundary,

            w = sin^2( pi/2 min(d / taper, 1) ),   d the distance from the boundary of the panel,

    (Hann's taper, narrower on a narrower panel) and its mean is taken out before: a wave is spread over about
    1 / taper in |k|, and a shape as large as a panel of 0.6 by 0.5 m leaves 0.03% of its energy below 0.1 m,
    where a sharp cut leaves 1%. Waves longer than half a panel are not told apart. The margin counts less
    than the middle, on both sides of a comparison alike.

    faces        (F, 3), sewn
    panels       (F, 3, 2), corners in panel space, metres; a uv layout, scaled to metres, does as well
    face_panel   (F,), panel of each face
    spacing, taper   metres

    Raises InputError for arrays that do not match or are not finite, and for spacings that are not positive
    or make images too large.
    """
    check_faces(faces, int(faces.max(initial=0)) + 1, "panel spectrum")
    corners = checked_corners(panels, len(faces), "panel spectrum")
    if corners.shape[2] != 2 or face_panel.shape != (len(faces),):
        raise InputError(
            f"panel spectrum: corners of shape {panels.shape} and panels of shape {face_panel.shape} for "
            f"{len(faces)} faces; give ({len(faces)}, 3, 2) and ({len(faces)},)"
        )
    if not (0.0 < spacing < np.inf and 0.0 <= taper < np.inf):
        raise InputError(f"panel spectrum: spacing = {spacing} m, taper = {taper} m; both must be positive")
    return tuple(
        _image(faces[face_panel == panel], corners[face_panel == panel], int(faces.max()) + 1, spacing, taper)
        for panel in np.unique(face_panel)
    )


def panel_energies(
    images: tuple[PanelImage, ...], values: np.ndarray, band_edges: tuple[float, ...] = PANEL_BAND_EDGES
) -> np.ndarray:
    """Mean square of values over the panels, wavelength band by band; (..., B), their unit squared.

        E_b = sum over panels, over k in b  |F(w (h - m))_k|^2 / N   /   sum over panels of sum w^2,

    F the two-dimensional discrete Fourier transform of N pixels, the wavelength 1 / |k|, m the mean of a
    panel, with the weights w^2; its energy m^2 belongs to the longest waves. All bands together are the mean
    of |h|^2 with the weights w^2 (Parseval).
    Give to `spectrum_score`, as the energies over eigenfunctions; these reach shorter waves for less.

    values       (..., V, d), such as `curvature_normals`, or prediction minus truth
    band_edges   metres, falling; none shorter than two pixels
    """
    edges = np.asarray(band_edges, dtype=np.float64)
    if len(edges) == 0 or (np.diff(edges) >= 0).any() or edges[-1] < 2.0 * images[0].spacing:
        raise InputError(
            f"panel spectrum: band edges {band_edges} m are not allowed; give falling wavelengths, none "
            f"below {2.0 * images[0].spacing} m, two pixels"
        )
    count = images[0].sampling.shape[1]
    if values.ndim < 2 or values.shape[-2] != count or not np.isfinite(values).all():
        raise InputError(
            f"panel spectrum: values of shape {values.shape} for {count} vertices; give finite ones, one each"
        )
    columns = np.moveaxis(values, -2, 0).reshape(count, -1)
    total = np.zeros((len(edges) + 1, columns.shape[1]))
    for image in images:
        band = np.searchsorted(1.0 / edges, image.frequencies[0], side="right")
        power = image.power(columns)
        total += np.stack([power[:, band == b].sum(axis=1) for b in range(len(total))])
    by_coordinate = total.reshape(len(total), *values.shape[:-2], values.shape[-1])
    whole = sum(float(np.square(image.window).sum()) for image in images)
    return np.moveaxis(by_coordinate.sum(axis=-1), 0, -1) / whole


def _image(
    faces: np.ndarray, corners: np.ndarray, num_vertices: int, spacing: float, taper: float
) -> PanelImage:
    low, high = corners.min(axis=(0, 1)), corners.max(axis=(0, 1))
    # A pixel more on each side, so that the panel ends within the image.
    nx, ny = (next_fast_len(int(np.ceil(extent / spacing)) + 2, real=True) for extent in high - low)
    if nx * ny > MOST_PIXELS:
        raise InputError(
            f"panel spectrum: a panel of {high[0] - low[0]:.3g} by {high[1] - low[1]:.3g} m has {nx * ny} "
            f"pixels of {spacing} m, {MOST_PIXELS} at most are allowed; check the unit, or take larger pixels"
        )
    x = low[0] + (np.arange(nx) - 0.5) * spacing
    y = low[1] + (np.arange(ny) - 0.5) * spacing
    middle = np.stack(np.meshgrid(x, y), axis=-1).reshape(-1, 2)
    squared, face, _ = igl.point_mesh_squared_distance(
        np.insert(middle, 2, 0.0, axis=1),
        np.insert(corners.reshape(-1, 2), 2, 0.0, axis=1),
        np.arange(3 * len(faces)).reshape(-1, 3),
    )
    inside = np.flatnonzero(squared <= (1e-6 * spacing) ** 2)
    mask = np.zeros((ny, nx), dtype=bool)
    mask.ravel()[inside] = True
    # Half a pixel less: the boundary runs between the last pixel inside and the first outside.
    depth = np.maximum(distance_transform_edt(mask) - 0.5, 0.0) * spacing
    margin = max(min(taper, float(depth.max())), 0.5 * spacing)
    window = np.sin(0.5 * np.pi * np.minimum(depth / margin, 1.0)) ** 2
    weights = barycentric(corners[face[inside]], middle[inside]) * window.ravel()[inside, None]
    columns = faces[face[inside]].ravel()
    sampling = csr_array(
        (weights.ravel(), (np.repeat(inside, 3), columns)), shape=(nx * ny, num_vertices), dtype=np.float64
    )
    return PanelImage(sampling, window, spacing)
