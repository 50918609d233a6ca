"""Draws docs/images/viewer.png: the viewer of a report, a walk beside two poor ways to guess it.

python docs/images/viewer.py out/demo/dataset docs/images/viewer.png
"""

from __future__ import annotations

import shutil
import sys
import tempfile
from pathlib import Path

import numpy as np
import trimesh
from PIL import Image
from playwright.sync_api import sync_playwright
from scipy.spatial import cKDTree

from muslin.eval.metrics.vertex import vertex_errors
from muslin.eval.viewer.page import viewer
from muslin.eval.viewer.scene import MovingMesh, Scene
from muslin.sim.dataset.reader import open_dataset
from muslin.sim.dataset.sample import Sample
from muslin.sim.view.picture import AZIMUTH, facing

FRAME = 22
SIZE = {"width": 1152, "height": 900}
FLAGS = ["--no-sandbox", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"]
NEIGHBOURS = 80
STYLE = "<style>body { font: 16px/1.5 system-ui, sans-serif; background: #fff; }</style>"


def carried(sample: Sample, frame: int) -> np.ndarray:
    """The first frame's cloth, each vertex moved rigidly with the body's vertices around it."""
    cloth, body, moved = sample.frame_positions(0), sample.body_vertices(0), sample.body_vertices(frame)
    _, near = cKDTree(body).query(cloth, NEIGHBOURS)
    before, after = body[near].astype(np.float64), moved[near].astype(np.float64)
    middle, new_middle = before.mean(axis=1), after.mean(axis=1)
    covariance = np.einsum("vni,vnj->vij", before - middle[:, None], after - new_middle[:, None])
    U, _, Vt = np.linalg.svd(covariance)
    Vt[:, 2] *= np.linalg.det(Vt.transpose(0, 2, 1) @ U.transpose(0, 2, 1))[:, None]
    return new_middle + np.einsum("vji,vj->vi", U @ Vt, cloth - middle)


def smoothed(positions: np.ndarray, faces: np.ndarray) -> np.ndarray:
    """The cloth without its small folds."""
    mesh = trimesh.Trimesh(positions, faces, process=False)
    return np.array(trimesh.smoothing.filter_taubin(mesh, lamb=0.6, nu=0.61, iterations=40).vertices)


def scene(sample: Sample) -> Scene:
    """Truth, carried cloth and smoothed cloth of a walk."""
    frames = range(sample.num_frames)
    truth = [sample.frame_positions(t).astype(np.float64) for t in frames]
    faces = [sample.garment.faces] * len(truth)
    sides = {"truth": MovingMesh(truth, faces)}
    guesses = {
        "carried by the body": [carried(sample, t) for t in frames],
        "smoothed": [smoothed(p, sample.garment.faces) for p in truth],
    }
    for name, guess in guesses.items():
        errors = [1000.0 * vertex_errors(p, q) for p, q in zip(guess, truth, strict=True)]
        sides[name] = MovingMesh(guess, faces, errors)
    body = MovingMesh([sample.body_vertices(t) for t in frames], [sample.body_faces] * len(truth))
    return Scene("t-shirt, walking", sides, sample.fps, body, azimuth=AZIMUTH + facing(sample, FRAME))


def main(path: str, out: str) -> None:
    sample = next(one for one in open_dataset(Path(path)) if one.num_frames > 1)
    page = viewer([scene(sample)])
    with tempfile.TemporaryDirectory() as folder, sync_playwright() as driver:
        file = Path(folder) / "viewer.html"
        file.write_text(f"<!doctype html><meta charset=utf-8>{STYLE}{page}", encoding="utf-8")
        browser = driver.chromium.launch(executable_path=shutil.which("chromium"), args=FLAGS)
        tab = browser.new_page(viewport=SIZE, device_scale_factor=1.25)
        tab.goto(file.as_uri())
        tab.wait_for_function("window.muslinViewers?.[0]?.scene")
        tab.evaluate(f"muslinViewers[0].seek({FRAME})")
        box = tab.locator(".mv-canvas").nth(1).bounding_box()
        assert box is not None
        tab.mouse.move(box["x"] + 0.5 * box["width"], box["y"] + 0.6 * box["height"])
        tab.wait_for_timeout(2000)
        tab.locator(".muslin-viewer").screenshot(path=out)
        browser.close()
    Image.open(out).convert("RGB").save(out, optimize=True)


if __name__ == "__main__":
    main(*sys.argv[1:])
