"""Store the triangulations of designs' reference panels: `python -m muslin.garments.bake`.

To be run, and its files committed, when a design's drawing, its reference or an edge length changes. Networks
trained on the old connectivity do not fit the new one.
"""

from __future__ import annotations

import numpy as np

from muslin.garments.cut import cut_pattern
from muslin.garments.template import EDGE_LENGTHS
from muslin.garments.topology import reference, store
from muslin.garments.uv_layout import BACKGROUND, BACKGROUND_EDGE_LENGTH

BAKED = ("tee",)  # designs that networks are trained on; templates of others are triangulated when asked for


def main() -> None:
    """Triangulate and store every resolution of the designs in BAKED."""
    wanted = {str(key): length for key, length in EDGE_LENGTHS.items()} | {BACKGROUND: BACKGROUND_EDGE_LENGTH}
    for name in BAKED:
        for resolution, edge_length in wanted.items():
            cut = cut_pattern(reference(name).pattern, edge_length, seed=0)
            # Index types of the stored arrays hold no more.
            assert len(cut.panel_vertices) <= np.iinfo(np.uint16).max
            path = store(cut, name, resolution, edge_length)
            print(f"{path.name}: {cut.num_vertices} vertices, {path.stat().st_size // 1024} KiB")


if __name__ == "__main__":
    main()
