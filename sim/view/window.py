"""An interactive window. The one part of muslin that needs a display and OpenGL."""

from __future__ import annotations

import ctypes
import os
import sys
from typing import Any

import numpy as np

from muslin.garments.errors import InputError
from muslin.sim.dataset.sample import Sample
from muslin.sim.view.layer import Layer
from muslin.sim.view.picture import sample_layers

LIBRARIES = ("libGL.so.1", "libX11.so.6", "libXrender.so.1", "libXcursor.so.1")
PACKAGES = "libgl1 libx11-6 libxrender1 libxcursor1"


def require_display() -> None:
    """Raise InputError that tells what is missing for a window, before VTK crashes for want of it."""
    if not sys.platform.startswith("linux"):
        return
    if not (os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY")):
        raise InputError(
            "view: this machine has no display (DISPLAY is not set); "
            "use `muslin render DIR --out FILE.png`, which needs none"
        )
    missing = [name for name in LIBRARIES if not _loads(name)]
    if missing:
        raise InputError(
            f"view: a window needs the system libraries {', '.join(missing)}; install them "
            f"(Debian, Ubuntu: apt-get install {PACKAGES}), or use `muslin render`, which needs none"
        )


def _loads(library: str) -> bool:
    try:
        ctypes.CDLL(library)
    except OSError:
        return False
    return True


def paint(layer: Layer) -> dict[str, Any]:
    """The colour of a layer, one or one a vertex, as `add_mesh` takes it."""
    if layer.colour.ndim == 1:
        return {"color": layer.colour}
    return {"scalars": np.rint(255.0 * layer.colour).astype(np.uint8), "rgb": True}


def draw(plotter: Any, sample: Sample, frame: int) -> None:
    """Put a frame of a sample into a PyVista plotter, in place of the frame that it shows."""
    import pyvista as pv

    for k, layer in enumerate(sample_layers(sample, frame)):
        mesh = pv.PolyData.from_regular_faces(layer.vertices, layer.faces)
        look = {"smooth_shading": True, "specular": layer.gloss, **paint(layer)}
        # A new actor each time: the topology may be another one.
        plotter.add_mesh(mesh, name=f"layer {k}", reset_camera=False, **look)


def show(sample: Sample) -> None:
    """Open a window with the sample; a sequence gets a slider over its frames. Returns when it is closed."""
    require_display()
    import pyvista as pv

    plotter: Any = pv.Plotter(title=f"muslin: {sample.id}", window_size=[900, 1100], lighting="three lights")
    plotter.set_background("#f4f3f0", top="#ffffff")
    draw(plotter, sample, 0)

    def show_frame(value: float) -> None:
        draw(plotter, sample, round(value))

    if sample.num_frames > 1:
        plotter.add_slider_widget(
            show_frame, [0, sample.num_frames - 1], value=0, title="frame", fmt="%0.f", style="modern"
        )
    plotter.camera_position = "xy"
    plotter.show()
