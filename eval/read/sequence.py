"""Folders of mesh files: which of them are the frames of one sequence, in which order."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from pathlib import Path

import numpy as np

from muslin.eval.read.content import Content, cloth_and_body, is_body, is_cloth
from muslin.eval.read.meshes import Surface, read_mesh
from muslin.garments.errors import InputError
from muslin.garments.mesh import GarmentMesh

_LAST_NUMBER = re.compile(r"(\d+)(?!.*\d)")


@dataclass(frozen=True)
class Series:
    """Files whose names differ in their last number, in the order of that number.

    gaps   pairs of numbers between which some are missing
    """

    name: str
    files: tuple[Path, ...]
    gaps: tuple[tuple[int, int], ...] = ()

    def remarks(self) -> tuple[str, ...]:
        """What a reader of scores has to know: that frames are missing."""
        if not self.gaps:
            return ()
        shown = ", ".join(f"{a} to {b}" for a, b in self.gaps[:3]) + (" …" if len(self.gaps) > 3 else "")
        return (
            f"{self.files[0].parent.name}: the numbers of its frames jump ({shown}); those that are there "
            "are taken as evenly spaced in time",
        )


def series_of(files: Sequence[Path]) -> list[Series]:
    """The series among the files. frame_2 comes before frame_10.

    Files without a number are a series in order of name where there are no others, else each is alone.
    Raises InputError for two files of one number.
    """
    numbered: dict[str, list[tuple[int, Path]]] = {}
    others: list[Path] = []
    for file in sorted(files):
        found = _LAST_NUMBER.search(file.stem)
        if found is None:
            others.append(file)
            continue
        name = file.stem[: found.start()] + "#" + file.stem[found.end() :] + file.suffix.lower()
        numbered.setdefault(name, []).append((int(found.group()), file))
    series = [_ordered(name, group) for name, group in numbered.items()]
    apart = numbered or any(is_body(file.stem) or is_cloth(file.stem) for file in others)
    if apart:
        return series + [Series(file.stem, (file,)) for file in others]
    return [Series("", tuple(others))]


def read_sequence(folder: Path, files: Sequence[Path]) -> Content:
    """The mesh files of a folder as one sequence.

    Several series are the garment and its body if their names say so (cloth_0001.obj, body_0001.obj; one
    body.obj stands still). Frames that follow one another in one topology share its faces and garment.
    """
    found = series_of(files)
    named = {series.name: series for series in found}
    cloth, body = (
        cloth_and_body(named, folder, "series of files") if len(found) > 1 else (found[0].name, None)
    )
    content = _read(named[cloth])
    if body is not None:
        content = replace(content, body=_read(named[body]))
    return content


def of_surfaces(surfaces: Sequence[Surface], notes: tuple[str, ...] = ()) -> Content:
    """Frames that were read whole, as content."""
    shared: list[Surface] = []
    for now in surfaces:
        before = shared[-1] if shared else now
        if np.array_equal(now.faces, before.faces) and _same_panels(now.garment, before.garment):
            now = replace(before, vertices=now.vertices, body=now.body)
        shared.append(now)
    garments = [s.garment for s in shared if s.garment is not None]
    bodies = [s.body for s in shared if s.body is not None]
    moving = len(bodies) == len(shared) and all(np.array_equal(b.faces, bodies[0].faces) for b in bodies)
    return Content(
        len(shared),
        lambda t: shared[t].vertices,
        [s.faces for s in shared],
        garments if len(garments) == len(shared) else (),
        body=of_surfaces(bodies) if bodies and moving else None,
        notes=notes,
    )


def _read(series: Series) -> Content:
    return of_surfaces([read_mesh(file) for file in series.files], series.remarks())


def _ordered(name: str, group: list[tuple[int, Path]]) -> Series:
    group = sorted(group)
    numbers = [number for number, _ in group]
    for (a, first), (b, second) in pairwise(group):
        if a == b:
            raise InputError(f"{first} and {second.name} have the same number {a}; keep one of them")
    steps = np.diff(numbers)
    usual = int(steps.min()) if len(steps) else 1
    gaps = tuple((numbers[k], numbers[k + 1]) for k in np.flatnonzero(steps != usual).tolist())
    return Series(name, tuple(file for _, file in group), gaps)


def _same_panels(a: GarmentMesh | None, b: GarmentMesh | None) -> bool:
    if a is None or b is None:
        return a is b
    return np.array_equal(a.panel_faces, b.panel_faces) and np.array_equal(a.panel_vertices, b.panel_vertices)
