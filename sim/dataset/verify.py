"""Check every sample of a dataset again from its geometry; what its certificate says is not looked at."""

from __future__ import annotations

import json
from collections.abc import Callable, Collection
from dataclasses import dataclass, field
from functools import lru_cache
from pathlib import Path
from typing import Any

import ipctk
import numpy as np

from muslin.garments.errors import InputError
from muslin.sim.body.interior import MASK_GAP_M, masked_face_is_interior
from muslin.sim.dataset import durable, store
from muslin.sim.dataset.header import read_header
from muslin.sim.dataset.index import in_plan_order, stored_rows
from muslin.sim.dataset.intersections import count_intersections
from muslin.sim.dataset.processes import (
    in_processes,
    leave_interrupts_to_parent,
    usable_cores,
)
from muslin.sim.dataset.root import Root, StoreError, open_root
from muslin.sim.dataset.sample import Sample

FRAMES_A_TASK = 24


@dataclass(frozen=True)
class Verification:
    """Sums over all samples that could be read; `failed`: {sample id: why}, in dataset order; empty if all is
    well.

    missing: samples that the dataset plans but does not hold yet.
    """

    samples: int
    frames: int
    cloth_cloth_intersections: int
    cloth_body_intersections: int
    masked_body_faces_max: int
    missing: int = 0
    failed: dict[str, str] = field(default_factory=dict)

    @property
    def passed(self) -> bool:
        return not self.failed

    def to_dict(self) -> dict[str, Any]:
        return {
            "samples": self.samples,
            "frames": self.frames,
            "cloth_cloth_intersections": self.cloth_cloth_intersections,
            "cloth_body_intersections": self.cloth_body_intersections,
            "masked_body_faces_max": self.masked_body_faces_max,
            "missing": self.missing,
            "failed": list(self.failed),
            "reasons": self.failed,
        }

    def write_json(self, path: str | Path) -> None:
        durable.write_file(Path(path), (json.dumps(self.to_dict(), indent=1) + "\n").encode())


@dataclass(frozen=True)
class _Task:
    root: Root
    sample_id: str
    start: int
    stop: int | None


@dataclass(frozen=True)
class Finding:
    """What was found in some frames of one sample; `reason` is empty if they are as they should be."""

    sample_id: str
    frames: int = 0
    cloth_cloth: int = 0
    cloth_body: int = 0
    masked_max: int = 0
    reason: str = ""


def verify(
    path: str | Path | Root,
    *,
    ids: Collection[str] | None = None,
    workers: int | None = None,
    progress: Callable[[float, int, str], None] | None = None,
) -> Verification:
    """Count intersections of every frame of every sample with ipctk, on the body computed again from its
    model.

    A sample fails if it is damaged (sha256, shapes, NaN, a garment that is no manifold), if its body model is
    not the one that it was made with, if any frame has an intersection, or if a body face was left out of
    contact that does not lie inside the body (or within `MASK_GAP_M` of another part of it). Raises
    InputError if the folder is no dataset.

    ids   check only these; unless given, all that are stored and all that the index lists
    """
    root = open_root(path)
    header = read_header(root)
    _sample.cache_clear()  # the dataset may have changed since this process verified it last
    stored = store.stored_ids(root)
    wanted = in_plan_order(header, {*stored_rows(root), *stored} if ids is None else ids)
    # Damaged attributes fail their sample, so they must not fail the listing.
    tasks = [task for sample_id in wanted for task in _tasks(root, sample_id)]
    count = min(workers or usable_cores(), max(1, len(tasks)))
    findings = []
    for done, finding in enumerate(in_processes(_run, tasks, count, _start_worker), start=1):
        findings.append(finding)
        if progress is not None:
            progress(done, len(tasks), finding.sample_id)
    return _summary(len(wanted), len(header.splits.keys() - {*wanted, *stored}), findings)


def _tasks(root: Root, sample_id: str) -> list[_Task]:
    """Blocks of frames; the last goes to the end of the sample, whatever its attributes say of its length."""
    try:
        frames = int(store.read_meta(root, sample_id)[0]["frames"])
    except (InputError, KeyError, ValueError):
        frames = 1
    starts = range(0, max(1, frames), FRAMES_A_TASK)
    return [
        _Task(root, sample_id, start, None if start == starts[-1] else start + FRAMES_A_TASK)
        for start in starts
    ]


def verify_sample(sample: Sample, start: int = 0, stop: int | None = None) -> Finding:
    """Check frames start to stop of a sample in memory."""
    frames = range(sample.num_frames)[start:stop]
    cloth_cloth = cloth_body = masked_max = 0
    reasons: list[str] = []
    for frame in frames:
        masked = sample.masked(frame)
        masked_max = max(masked_max, len(masked))
        counts, reason = _check_frame(sample, frame, masked)
        cloth_cloth += counts[0]
        cloth_body += counts[1]
        if reason:
            reasons.append(f"frame {frame}: {reason}")
    summary = (
        reasons[0] + (f" (and {len(reasons) - 1} more frames)" if len(reasons) > 1 else "") if reasons else ""
    )
    return Finding(sample.id, len(frames), cloth_cloth, cloth_body, masked_max, summary)


def _check_frame(sample: Sample, frame: int, masked: np.ndarray) -> tuple[tuple[int, int], str]:
    body, faces = sample.body_vertices(frame), sample.body_faces
    if not np.isfinite(body).all():
        return (0, 0), "NaN or infinity in the body"
    if masked.size and (masked.min() < 0 or masked.max() >= len(faces)):
        return (0, 0), f"masked faces must be from 0 to {len(faces) - 1}"
    kept = np.ones(len(faces), dtype=bool)
    kept[masked] = False
    cloth = sample.frame_garment(frame).faces
    counts = count_intersections(sample.frame_positions(frame), cloth, body, faces[kept])
    reasons = []
    if counts.cloth_cloth:
        reasons.append(f"{counts.cloth_cloth} cloth-cloth intersections")
    if counts.cloth_body:
        reasons.append(f"{counts.cloth_body} cloth-body intersections")
    if masked.size:
        outside = int(np.count_nonzero(~masked_face_is_interior(body, faces, masked, MASK_GAP_M)))
        if outside:
            reasons.append(f"{outside} of {len(masked)} masked body faces do not lie inside the body")
    return (counts.cloth_cloth, counts.cloth_body), ", ".join(reasons)


def _start_worker() -> None:
    leave_interrupts_to_parent()
    ipctk.set_num_threads(1)


def _run(task: _Task) -> Finding:
    try:
        return verify_sample(_sample(task.root, task.sample_id), task.start, task.stop)
    except StoreError:
        raise
    except InputError as error:
        return Finding(task.sample_id, reason=str(error))


@lru_cache(maxsize=2)
def _sample(root: Root, sample_id: str) -> Sample:
    sample = store.read_sample(root, sample_id)
    for garment in sample.garments:
        garment.validate()
    return sample


def _summary(samples: int, missing: int, findings: list[Finding]) -> Verification:
    failed: dict[str, str] = {}
    for finding in findings:
        if finding.reason:
            failed.setdefault(finding.sample_id, finding.reason)
    return Verification(
        samples=samples,
        frames=sum(finding.frames for finding in findings),
        cloth_cloth_intersections=sum(finding.cloth_cloth for finding in findings),
        cloth_body_intersections=sum(finding.cloth_body for finding in findings),
        masked_body_faces_max=max((finding.masked_max for finding in findings), default=0),
        missing=missing,
        failed=failed,
    )
