"""Pictures of patterns: panels to scale, apart, with names, lengths and seam numbers."""

from __future__ import annotations

import itertools
from pathlib import Path

import numpy as np
import pytest
from matplotlib.text import Text

from muslin.garments import catalogue
from muslin.garments.drawing import draw_pattern, save_drawing
from muslin.garments.errors import InputError
from muslin.garments.layout import arrange
from muslin.garments.template import template

PATTERN = catalogue.get("tee").pattern()


def test_shows_every_panel_edge_length_and_seam() -> None:
    figure = draw_pattern(PATTERN)
    texts = [text.get_text() for text in figure.axes[0].findobj(Text)]
    for panel in PATTERN.panels:
        assert panel.name.replace("_", " ") in texts
        for edge in panel.edges:
            assert f"{edge.name.replace('_', ' ')}  {100 * edge.curve.length:.1f} cm" in texts
    for number in range(1, len(PATTERN.seams) + 1):
        assert texts.count(str(number)) == 2


def test_panels_are_drawn_to_scale_and_apart() -> None:
    polygons = [np.asarray(patch.get_xy()) for patch in draw_pattern(PATTERN).axes[0].patches[:4]]
    for polygon, panel in zip(polygons, PATTERN.panels, strict=True):
        x, y = polygon.T
        assert 0.5 * np.sum(x[:-1] * y[1:] - x[1:] * y[:-1]) == pytest.approx(panel.area, rel=2e-3)
    for a, b in itertools.combinations(polygons, 2):
        apart = (a.max(axis=0) < b.min(axis=0)) | (b.max(axis=0) < a.min(axis=0))
        assert apart.any()


def test_files_are_pictures_and_svg_is_repeatable(tmp_path: Path) -> None:
    save_drawing(PATTERN, tmp_path / "a.png", template("tee", {}, 403))
    assert (tmp_path / "a.png").read_bytes().startswith(b"\x89PNG")
    for name in ("a.svg", "b.svg"):
        save_drawing(PATTERN, tmp_path / name)
    assert (tmp_path / "a.svg").read_bytes() == (tmp_path / "b.svg").read_bytes()
    assert b"<svg" in (tmp_path / "a.svg").read_bytes()


def test_other_suffixes_are_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"cannot draw to '\.bmp'; allowed: \.png, \.svg"):
        save_drawing(PATTERN, tmp_path / "tee.bmp")


def test_arranged_boxes_keep_their_gap() -> None:
    rng = np.random.default_rng(2)
    for count in (1, 2, 5, 9):
        sizes = rng.uniform(0.1, 1.0, size=(count, 2))
        corners, size = arrange(list(sizes), 0.05)
        assert (corners >= 0.0).all()
        np.testing.assert_allclose((corners + sizes).max(axis=0), size)
        for i, j in itertools.combinations(range(count), 2):
            gap = np.maximum(corners[i] - corners[j] - sizes[j], corners[j] - corners[i] - sizes[i])
            assert gap.max() >= 0.05 - 1e-12
