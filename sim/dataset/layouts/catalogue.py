"""The layouts, by the name that the command line gives them."""

from __future__ import annotations

from muslin.sim.dataset.layouts.cloth3d import CLOTH3D
from muslin.sim.dataset.layouts.hood import HOOD
from muslin.sim.dataset.layouts.layout import Layout
from muslin.sim.dataset.layouts.obj import OBJ

LAYOUTS: dict[str, Layout] = {"obj": OBJ, "cloth3d": CLOTH3D, "hood": HOOD}
