"""Makes the networks that come with the package, of half the size, from a trained pipeline.

muslin generate scenes/datasets/thesis_static.toml --preset small --out out/static
muslin train drape --dataset out/static --out out/drape --epochs 40
muslin train collisions out/drape --dataset out/static --out out/tuned
python -m muslin.learn.drape.bake out/tuned
"""

from __future__ import annotations

import sys
from pathlib import Path

import torch

from muslin.learn.drape.pipeline import load_pipeline
from muslin.learn.drape.predict import SHIPPED


def bake(trained: Path, out: Path = SHIPPED) -> None:
    """Write the pipeline of a folder in bfloat16."""
    load_pipeline(trained).save(out, torch.bfloat16)


if __name__ == "__main__":
    bake(*map(Path, sys.argv[1:]))
