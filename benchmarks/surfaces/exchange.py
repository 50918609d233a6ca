"""What a package is given and what it writes: pairs of meshes, seconds, figures, versions."""

from __future__ import annotations

import argparse
import json
import time
from collections.abc import Callable
from dataclasses import dataclass
from importlib.metadata import version
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

RECORD_FILE = "record.json"
SAMPLES_FILE = "samples.json"
ARRAYS = ("vertices_a", "faces_a", "vertices_b", "faces_b")


@dataclass(frozen=True, eq=False)
class Pair:
    """Two meshes: vertices (V, 3) float64, metres, and faces (F, 3) int32 of each; and how many points of
    each a package that samples is to take, 0 for its own choice."""

    vertices_a: NDArray[np.float64]
    faces_a: NDArray[np.int32]
    vertices_b: NDArray[np.float64]
    faces_b: NDArray[np.int32]
    samples: int = 0

    def save(self, file: Path) -> None:
        """Write the meshes to an npz file."""
        file.parent.mkdir(parents=True, exist_ok=True)
        np.savez(file, **{name: getattr(self, name) for name in ARRAYS})


def load_pairs(folder: Path) -> dict[str, Pair]:
    """What `Pair.save` wrote into a folder, by the names of the files."""
    told = folder / SAMPLES_FILE
    samples = json.loads(told.read_text(encoding="utf-8")) if told.exists() else {}
    found = {}
    for file in sorted(folder.glob("*.npz")):
        with np.load(file) as stored:
            a, fa, b, fb = (stored[name] for name in ARRAYS)
            found[file.stem] = Pair(a, fa, b, fb, samples.get(file.stem, 0))
    return found


def contend(measure: Callable[[Pair], dict[str, float]], packages: tuple[str, ...]) -> None:
    """The command line of a package: measure every pair by name."""
    parser = argparse.ArgumentParser()
    parser.add_argument("pairs", type=Path)
    parser.add_argument("out", type=Path)
    given = parser.parse_args()
    given.out.mkdir(parents=True, exist_ok=True)
    pairs = load_pairs(given.pairs)
    seconds, figures = {}, {}
    for name, pair in pairs.items():
        start = time.process_time()
        figures[name] = measure(pair)
        seconds[name] = time.process_time() - start
    record = {
        "seconds": seconds,
        "figures": figures,
        "versions": {name: version(name) for name in packages},
    }
    (given.out / RECORD_FILE).write_text(json.dumps(record, indent=1), encoding="utf-8")


def fixed_points(pair: Pair) -> NDArray[np.float64]:
    """2,000 points near the first mesh, the same in every process: places on its faces, moved a little."""
    rng = np.random.default_rng(0)
    corners = pair.vertices_a[pair.faces_a[rng.integers(len(pair.faces_a), size=2000)]]
    places = np.einsum("nk,nkc->nc", rng.dirichlet(np.ones(3), 2000), corners)
    return places + 0.01 * np.ptp(pair.vertices_a) * rng.normal(size=places.shape)
