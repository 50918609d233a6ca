"""The examples of scenes/remesh/ as they stand there, on a drape so coarse that it takes seconds."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from muslin.garments.obj import read_garment
from muslin.sim.dataset.intersections import count_intersections
from muslin.sim.dataset.reader import open_dataset

ROOT = Path(__file__).resolve().parents[2]
REDUCED = [
    part
    for key in ("garment.edge_length=0.065", "solver.settle_steps=2", "solver.dt=0.034")
    for part in ("--set", key)
]


def run(script: str, *arguments: str) -> list[str]:
    """The lines that an example prints."""
    binaries = Path(sys.executable).parent
    environment = os.environ | {"PATH": f"{binaries}{os.pathsep}{os.environ['PATH']}"}
    command = ["sh", f"scenes/remesh/{script}", *arguments, *REDUCED]
    done = subprocess.run(command, cwd=ROOT, env=environment, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    return done.stdout.splitlines()


def check(folder: Path, areas: dict[str, float | None]) -> None:
    """Garments of these names and mean areas, each of its own topology, none of which crosses anything."""
    sample = open_dataset(folder / "drape")[0]
    body = sample.body_vertices(0), np.delete(sample.body_faces, sample.masked(0), axis=0)
    assert {path.stem for path in folder.glob("*.obj")} == set(areas)
    faces = set()
    for name, area in areas.items():
        mesh, positions = read_garment(folder / f"{name}.obj")
        assert positions is not None
        counts = count_intersections(positions, mesh.faces, *body)
        assert (counts.cloth_cloth, counts.cloth_body) == (0, 0)
        if area is not None:
            assert mesh.face_areas.mean() == pytest.approx(area, rel=0.01)
        faces.add(mesh.panel_faces.tobytes())
    assert len(faces) == len(areas)


def test_examples_end_with_what_they_are_named_for(tmp_path: Path) -> None:
    phi, topologies = tmp_path / "phi", tmp_path / "topologies"
    assert len(run("phi.sh", str(phi))) == 1 + 3
    check(phi, {"uniform": 5e-4, "front": None, "folds": 5e-4})
    # A drape that is there is not made again.
    topologies.mkdir()
    (topologies / "drape").symlink_to(phi / "drape")
    assert len(run("topologies.sh", str(topologies), "3")) == 3
    check(topologies, {f"long_dress_{seed}": 5e-4 for seed in range(3)})
