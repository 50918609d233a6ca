"""What contact metrics cost on a sequence, beside the slow way to the same figures.

    python -m benchmarks.contact [SETTING]

SETTING is what `python -m benchmarks setting` makes: a dress of 4,176 vertices on a walking body of 12,272.
The "prediction" carries the dress along by the nearest body vertex at rest, so it enters body and itself as
poor predictions do. Times are processor time of one process.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Callable
from dataclasses import asdict
from pathlib import Path
from typing import TypeVar

import numpy as np
from scipy.spatial import cKDTree

from muslin.eval.metrics.contact import body_contact, self_contact
from muslin.eval.metrics.contact_summary import ContactAccumulator
from muslin.eval.metrics.penetration import signed_distances
from muslin.eval.metrics.penetration_definitions import penetration_definitions
from muslin.sim.dataset.intersections import count_intersections

SETTING = Path("out/benchmarks/setting.npz")
EVERY = 10
"""Only each so many frames the slow ways are run."""

Result = TypeVar("Result")


def main(path: Path) -> None:
    with np.load(path) as data:
        start, faces, body_faces = data["positions"], data["faces"], data["body_faces"]
        body = data["body"].astype(np.float64)
    _, bone = cKDTree(body[0]).query(start)
    accumulator, spent = ContactAccumulator(), dict[str, list[float]]()

    def timed(work: Callable[..., Result], *arrays: np.ndarray) -> Result:
        before = time.process_time()
        result = work(*arrays)
        spent.setdefault(work.__name__, []).append(time.process_time() - before)
        return result

    frames = range(1, len(body))
    for t in frames:
        cloth = start + body[t][bone] - body[0][bone]
        mesh = (cloth, faces, body[t], body_faces)
        touching, own = timed(body_contact, *mesh), timed(self_contact, cloth, faces)
        accumulator.update(touching, own)
        if t % EVERY == 0:
            slow, count = timed(signed_distances, cloth, *mesh[2:]), timed(count_intersections, *mesh)
            timed(penetration_definitions, *mesh)
            if not np.array_equal(np.maximum(-slow, 0.0), touching.depths):
                raise AssertionError(f"frame {t}: depths differ from signed_distances")
            if (count.cloth_body > 0, count.cloth_cloth > 0) != (touching.pairs > 0, own.pairs > 0):
                raise AssertionError(f"frame {t}: {count}, but {touching.pairs} and {own.pairs} pairs")
    for name, seconds in spent.items():
        print(f"{name:24} {1e3 * float(np.median(seconds)):7.1f} ms a frame (median of {len(seconds)})")
    total = sum(spent["body_contact"]) + sum(spent["self_contact"])
    print(f"body_contact and self_contact of {len(frames)} frames: {total:.1f} s")
    for result in (accumulator.body_result(), accumulator.self_result()):
        assert result is not None
        print({name: round(v, 6) if isinstance(v, float) else v for name, v in asdict(result).items()})


if __name__ == "__main__":
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else SETTING)
