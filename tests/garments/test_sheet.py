"""The sheet: a rectangle of the stated size, meshed and laid out in uv like any design."""

from __future__ import annotations

import numpy as np
import pytest

from muslin.garments import catalogue
from muslin.garments.mesh import corner_angles
from muslin.garments.triangulate import triangulate

SHEET = catalogue.get("sheet")


@pytest.mark.parametrize(("width", "length"), [(1.0, 1.0), (0.3, 0.9), (2.0, 0.2)])
def test_sheet_is_a_disc_of_its_size(width: float, length: float) -> None:
    mesh = triangulate(SHEET.pattern(width=width, length=length), 0.08)
    assert mesh.euler_characteristic == 1
    assert len(mesh.boundary_loops) == 1
    assert mesh.face_areas.sum() == pytest.approx(width * length, abs=1e-12)
    np.testing.assert_allclose(np.ptp(mesh.panel_vertices, axis=0), [width, length], atol=1e-15)
    np.testing.assert_allclose(mesh.panel_vertices.max(axis=0), [width / 2, length / 2], atol=1e-15)
    assert np.degrees(corner_angles(mesh.panel_vertices, mesh.panel_faces)).min() > 20.0
    # The layout shows the square reference sheet, whatever the sheet's proportions.
    np.testing.assert_allclose(mesh.uv.min(axis=0), 0.02, atol=1e-12)
    np.testing.assert_allclose(mesh.uv.max(axis=0), 0.98, atol=1e-12)
