"""What a sample was made of, and the terms of each."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from muslin.sim.dataset import licences
from muslin.sim.dataset.sample import Sample

Terms = Callable[[str], tuple[str, str]]


def sources_of(sample: Sample) -> list[dict[str, str]]:
    """Body, motion, fabrics and pattern files of a sample: {what, name, source, terms} of each, once.

    Of files of the maker's own only the names are told, not where they lay.
    """
    scene = sample.scene
    layers = scene.get("layers") or ()
    garments = [scene.get("garment") or {}, *layers]
    named: list[tuple[str, object, Terms]] = [
        ("body", sample.body and sample.body.model, licences.body_source),
        ("motion", (scene.get("motion") or {}).get("clip"), licences.motion_source),
        ("fabric", sample.fabric, licences.fabric_source),
        *(("fabric", layer.get("fabric"), licences.fabric_source) for layer in layers),
        *(("garment", entry.get("pattern") or entry.get("mesh"), _own) for entry in garments),
    ]
    told = []
    for what, name, terms_of in named:
        if not isinstance(name, str) or not name:
            continue
        source, terms = terms_of(name)
        entry = {"what": what, "name": Path(name).name, "source": source, "terms": terms}
        if entry not in told:
            told.append(entry)
    return told


def _own(name: str) -> tuple[str, str]:
    return licences.OWN
