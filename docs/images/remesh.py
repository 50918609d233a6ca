"""Draws docs/images/remesh.png: topologies of one drape, their front panels above them.

python docs/images/remesh.py out/long_dress docs/images/remesh.png
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
from PIL import Image

from muslin.eval.remesh_source import RemeshSource, remesh_source
from muslin.garments.mesh import GarmentMesh
from muslin.sim.device import open_device
from muslin.sim.remesh.drape_metric import drape_metric
from muslin.sim.remesh.fit import topologies
from muslin.sim.remesh.settings import RemeshSettings
from muslin.sim.view.camera import frame_camera
from muslin.sim.view.layer import FABRIC, SKIN, Layer
from muslin.sim.view.picture import AZIMUTH, ELEVATION
from muslin.sim.view.render import render
from muslin.sim.view.sheet import contact_sheet

AREA = 8e-4
PALE = 0.35 * np.array(FABRIC) + 0.65
PANEL, WORN = (330, 400), (330, 620)
FOLDS = RemeshSettings(
    refine_angle=0.3, refine_compression=0.01, size_min=0.01, size_max=0.12, aspect_min=0.3
)


def front_panel(mesh: GarmentMesh) -> np.ndarray:
    """The first panel, flat, with its triangles."""
    faces = mesh.panel_faces[mesh.face_panel == 0]
    points = np.pad(mesh.panel_vertices, ((0, 0), (0, 1)))
    lines = np.ones(faces.shape, dtype=bool)
    camera = frame_camera(points[np.unique(faces)], *PANEL, 0.0, 0.0)
    sheet = Layer(points, faces, PALE, sheet=True, gloss=0.0, seams=lines, flat_light=True)
    return render([sheet], camera, PANEL)


def worn(source: RemeshSource, mesh: GarmentMesh, positions: np.ndarray) -> np.ndarray:
    """The drape on its body, with its triangles."""
    lines = np.ones(mesh.faces.shape, dtype=bool)
    body = Layer(source.body_vertices, source.body_faces, np.array(SKIN), gloss=0.12)
    cloth = Layer(positions, mesh.faces, PALE, sheet=True, gloss=0.02, seams=lines)
    camera = frame_camera(positions, *WORN, AZIMUTH, ELEVATION)
    return render([body, cloth], camera, WORN)


def main(path: str, out: str) -> None:
    open_device("cpu")
    source = remesh_source(Path(path))
    assert source.positions is not None
    body = {"body_vertices": source.body_vertices, "body_faces": source.body_faces}
    made = list(topologies(source.mesh, source.positions, AREA, 3, **body))
    folds = drape_metric(source.mesh, source.positions, FOLDS, AREA)
    made += topologies(source.mesh, source.positions, folds, 1, **body)
    names = ["seed 0", "seed 1", "seed 2", "sized by the drape"]
    captions = [f"{name}: {one.mesh.num_vertices} vertices" for name, one in zip(names, made, strict=True)]
    above = contact_sheet([front_panel(one.mesh) for one in made], 4, captions)
    below = contact_sheet([worn(source, one.mesh, one.positions) for one in made], 4)
    picture = Image.fromarray(np.concatenate([above, below]))
    picture.quantize(256, dither=Image.Dither.NONE).save(out, optimize=True)


if __name__ == "__main__":
    main(*sys.argv[1:])
