"""Contact over a sequence: feed frames, read the figures of all of them at the end."""

from __future__ import annotations

from dataclasses import dataclass, field

from muslin.eval.metrics.contact import BodyContact, SelfContact
from muslin.eval.metrics.penetration import PSEUDONORMAL
from muslin.garments.errors import InputError


@dataclass(frozen=True)
class BodyContactSummary:
    """A cloth against a body over T frames.

    frames, touched    number of frames, and of those with an intersecting pair or a vertex inside
    vertex_ratio       share of vertices inside, of all vertices of all frames
    area_ratio         share of the area inside, of the area in all frames
    area_uncertain     share of the area whose part inside was sampled, not computed exactly; `area_ratio` is
                       off by less
    depth_mean         mean depth of the vertices inside, metres; 0 if none is
    depth_area_mean    mean depth over the area inside, volume / area, metres; 0 if none is
    depth_max          largest depth of a vertex, metres
    surface_depth      largest depth of a vertex or sample of the surface, metres
    volume_mean, _max  volume of a frame, m^3
    pairs_mean, _max   intersecting pairs of a frame
    contour_mean, _max length of the contour of a frame, metres
    coplanar           pairs in one plane, in all frames
    method             how the sign was found; the fallback's name if any frame needed it
    """

    frames: int
    touched: int
    vertex_ratio: float
    area_ratio: float
    area_uncertain: float
    depth_mean: float
    depth_area_mean: float
    depth_max: float
    surface_depth: float
    volume_mean: float
    volume_max: float
    pairs_mean: float
    pairs_max: int
    contour_mean: float
    contour_max: float
    coplanar: int
    method: str


@dataclass(frozen=True)
class SelfContactSummary:
    """A cloth against itself over T frames; names as in `BodyContactSummary`."""

    frames: int
    touched: int
    pairs_mean: float
    pairs_max: int
    contour_mean: float
    contour_max: float
    coplanar: int


@dataclass
class ContactAccumulator:
    """Collects frames of contact."""

    body: list[BodyContact] = field(default_factory=list)
    own: list[SelfContact] = field(default_factory=list)

    def update(self, body: BodyContact | None = None, own: SelfContact | None = None) -> None:
        if body is not None:
            self.body.append(body)
        if own is not None:
            self.own.append(own)

    def merge(self, other: ContactAccumulator) -> None:
        """Add the frames of another."""
        self.body += other.body
        self.own += other.own

    def body_result(self) -> BodyContactSummary | None:
        """None if no frame came."""
        return summarise_body_contact(self.body) if self.body else None

    def self_result(self) -> SelfContactSummary | None:
        """None if no frame came."""
        return summarise_self_contact(self.own) if self.own else None


def summarise_body_contact(frames: list[BodyContact]) -> BodyContactSummary:
    """The figures over all frames; sums are divided once, so a frame counts by its vertices and its area."""
    _require(len(frames))
    inside = sum(frame.inside for frame in frames)
    area, area_inside = sum(frame.area for frame in frames), sum(frame.area_inside for frame in frames)
    volume = sum(frame.volume for frame in frames)
    methods = {frame.method for frame in frames}
    return BodyContactSummary(
        frames=len(frames),
        touched=sum(frame.pairs > 0 or frame.inside > 0 for frame in frames),
        vertex_ratio=inside / sum(frame.vertices for frame in frames),
        area_ratio=area_inside / area if area > 0.0 else 0.0,
        area_uncertain=sum(frame.area_sampled for frame in frames) / area if area > 0.0 else 0.0,
        depth_mean=sum(frame.depth_sum for frame in frames) / inside if inside else 0.0,
        depth_area_mean=volume / area_inside if area_inside > 0.0 else 0.0,
        depth_max=max(frame.depth_max for frame in frames),
        surface_depth=max(frame.surface_depth for frame in frames),
        volume_mean=volume / len(frames),
        volume_max=max(frame.volume for frame in frames),
        pairs_mean=sum(frame.pairs for frame in frames) / len(frames),
        pairs_max=max(frame.pairs for frame in frames),
        contour_mean=sum(frame.contour for frame in frames) / len(frames),
        contour_max=max(frame.contour for frame in frames),
        coplanar=sum(frame.coplanar for frame in frames),
        method=PSEUDONORMAL if PSEUDONORMAL in methods else methods.pop(),
    )


def summarise_self_contact(frames: list[SelfContact]) -> SelfContactSummary:
    """The figures over all frames."""
    _require(len(frames))
    return SelfContactSummary(
        frames=len(frames),
        touched=sum(frame.pairs > 0 for frame in frames),
        pairs_mean=sum(frame.pairs for frame in frames) / len(frames),
        pairs_max=max(frame.pairs for frame in frames),
        contour_mean=sum(frame.contour for frame in frames) / len(frames),
        contour_max=max(frame.contour for frame in frames),
        coplanar=sum(frame.coplanar for frame in frames),
    )


def _require(frames: int) -> None:
    if not frames:
        raise InputError("contact of no frames: give at least one")
