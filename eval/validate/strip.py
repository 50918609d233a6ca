"""The strip of cloth that several cases hold by its ends."""

from __future__ import annotations

from muslin.eval.validate.case import CaseTable, Count
from muslin.eval.validate.meshes import Triangulation, rectangle
from muslin.garments.mesh import GarmentMesh
from muslin.sim.tables import Positive


class Strip(CaseTable):
    """`length`, `width`, `thickness` m; `density` kg/m^2; `elements` along and `across`, cut in each of the
    `triangulations`."""

    triangulations: list[Triangulation]
    length: Positive
    width: Positive
    thickness: Positive
    density: Positive
    elements: Count
    across: Count
    bar: Positive

    def mesh(self, triangulation: Triangulation) -> GarmentMesh:
        """The strip in its panel: [0, width] x [0, length]."""
        return rectangle(self.width, self.length, self.across, self.elements, triangulation, self.seed)
