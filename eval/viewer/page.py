"""A fragment of HTML in which scenes are played side by side; it needs nothing but itself."""

from __future__ import annotations

import json
from collections.abc import Sequence
from functools import cache
from importlib.resources import files
from typing import Any

import numpy as np
from markupsafe import Markup

from muslin.eval.plots import COLOURS
from muslin.eval.viewer.encode import BODY_RESOLUTION, encode_mesh
from muslin.eval.viewer.scene import MovingMesh, Scene
from muslin.garments.errors import InputError
from muslin.sim.view.heatmap import STOPS

# in the order in which they need each other
SCRIPTS = (
    "decode.js",
    "stage.js",
    "surface.js",
    "orbit.js",
    "plot.js",
    "controls.js",
    "pane.js",
    "player.js",
    "start.js",
)
MAX_FRAMES = 300  # of a scene
# vertices times frames, summed over all scenes, their sides and bodies: some 3 to 4 bytes of the page each
BUDGET = 12_000_000
HIGH_QUANTILE = 0.99

__all__ = ["MovingMesh", "Scene", "viewer"]


def viewer(scenes: Sequence[Scene], *, library: bool = True, budget: int = BUDGET) -> Markup:
    """Scenes as a fragment of HTML: players with a common camera, error heat maps, and errors over frames.

    library   carry scripts and style (0.6 MB); False for a page's second and later viewers
    budget    vertices times frames that the page may hold; beyond it frames are left out, as the page says
    Raises InputError for an empty list, for frames that do not match, and for numbers that are not finite.
    """
    if not scenes:
        raise InputError("viewer: no scene to show; give at least one")
    for scene in scenes:
        scene.validate()
    stride = _stride(scenes, budget)
    data = {
        "colours": STOPS.tolist(),
        "series": COLOURS,
        "scenes": [_encode_scene(scene, stride) for scene in scenes],
    }
    # "<" could end the script element that holds the data
    text = json.dumps(data, separators=(",", ":"), allow_nan=False).replace("<", "\\u003c")
    holder = (
        '<div class="muslin-viewer"><noscript>The player needs JavaScript.</noscript>'
        f'<script type="application/json">{text}</script></div>\n'
    )
    head = f"<style>\n{asset('viewer.css')}</style>\n" if library else ""
    tail = f"<script>\n{_program()}</script>\n" if library else "<script>muslinViewers.start();</script>\n"
    return Markup(head + holder + tail)


def asset(name: str) -> str:
    """The text of a file of this package's assets."""
    return files("muslin.eval.viewer").joinpath("assets", name).read_text(encoding="utf-8")


@cache
def _program() -> str:
    """three.js and the viewer's scripts in one scope; a second copy in a page only starts its viewers."""
    parts = "\n".join(asset(name) for name in SCRIPTS)
    licence = asset("three.LICENSE.txt").strip()
    return (
        f'if (!window.muslinViewers) (() => {{\n"use strict";\n/*!\nthree.js\n{licence}\n*/\n'
        f"{asset('three.min.js')}\n{parts}}})();\nmuslinViewers.start();\n"
    )


def _stride(scenes: Sequence[Scene], budget: int) -> int:
    """Every how many frames one is kept, so that all scenes together stay within the budget."""
    longest = max(scene.num_frames for scene in scenes)
    stride = 1
    while stride < longest and sum(_size(scene, stride) for scene in scenes) > budget:
        stride += 1
    return stride


def _size(scene: Scene, stride: int) -> int:
    stride = _own_stride(scene, stride)
    meshes = [*scene.sides.values(), *([scene.body] if scene.body is not None else [])]
    return sum(len(positions) for mesh in meshes for positions in mesh.positions[::stride])


def _own_stride(scene: Scene, stride: int) -> int:
    return max(stride, -(-scene.num_frames // MAX_FRAMES))


def _encode_scene(scene: Scene, stride: int) -> dict[str, Any]:
    stride = _own_stride(scene, stride)
    body = scene.body
    return {
        "name": scene.name,
        "fps": None if scene.fps is None else float(scene.fps),
        "unit": scene.unit,
        "high": float(scene.high or _high(scene, stride)),
        "azimuth": float(scene.azimuth),
        "frames": scene.num_frames,
        "stride": stride,
        "sides": [
            {"name": name, "mesh": encode_mesh(mesh.every(stride)), "means": _means(mesh)}
            for name, mesh in scene.sides.items()
        ],
        "body": None if body is None else encode_mesh(body.every(stride), BODY_RESOLUTION),
    }


def _means(mesh: MovingMesh) -> list[float] | None:
    """Mean over the vertices in every frame, those that are left out of the page too."""
    if mesh.values is None:
        return None
    return [float(f"{np.mean(values):.4g}") for values in mesh.values]


def _high(scene: Scene, stride: int) -> float:
    """The value below which most of the page's values lie; 1 where there is no error at all."""
    sides = [mesh.values for mesh in scene.sides.values() if mesh.values is not None]
    found = [values for side in sides for values in side[::stride]]
    if not found:
        return 1.0
    everything = np.concatenate(found)
    return float(np.quantile(everything, HIGH_QUANTILE)) or float(everything.max()) or 1.0
