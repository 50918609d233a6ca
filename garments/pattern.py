"""Sewing patterns: panels and the seams that join them."""

from __future__ import annotations

from dataclasses import dataclass, field

from muslin.garments.errors import InputError
from muslin.garments.panels import Panel, PanelEdge
from muslin.garments.seams import EdgeRef, Seam

SEAM_TOLERANCE = 1e-4  # metres; two edges of a seam may differ by no more (thread, not ease)


@dataclass(frozen=True)
class Pattern:
    """Panels and seams, metres.

    name: the design it was drawn from ("tee"), or any name of a pattern made by hand.
    parameters: the design parameters it was drawn with, metres; empty for a pattern made by hand.
    """

    name: str
    panels: tuple[Panel, ...]
    seams: tuple[Seam, ...]
    parameters: dict[str, float] = field(default_factory=dict)

    def panel(self, name: str) -> Panel:
        """The panel of that name; InputError if there is none."""
        for panel in self.panels:
            if panel.name == name:
                return panel
        names = ", ".join(p.name for p in self.panels)
        raise InputError(f"pattern '{self.name}' has no panel '{name}'; its panels are: {names}")

    def edge(self, ref: EdgeRef) -> PanelEdge:
        """The edge that `ref` names; InputError if there is none."""
        return self.panel(ref.panel).edge(ref.edge)

    @property
    def area(self) -> float:
        """Area of all panels, square metres."""
        return sum(panel.area for panel in self.panels)

    @property
    def free_edges(self) -> tuple[EdgeRef, ...]:
        """Edges in no seam: hems, cuffs, neckline."""
        sewn = {ref for seam in self.seams for ref in (seam.first, seam.second)}
        refs = (EdgeRef(panel.name, edge.name) for panel in self.panels for edge in panel.edges)
        return tuple(ref for ref in refs if ref not in sewn)

    def validate(self) -> None:
        """InputError unless every panel is sound and every seam joins two different edges of equal length."""
        if not self.panels:
            raise InputError(f"pattern '{self.name}' has no panels; it needs at least one")
        names = [panel.name for panel in self.panels]
        repeated = sorted({name for name in names if names.count(name) > 1})
        if repeated:
            raise InputError(f"pattern '{self.name}' names panel '{repeated[0]}' twice; names must differ")
        for panel in self.panels:
            panel.validate()
        used: set[EdgeRef] = set()
        for seam in self.seams:
            first, second = self.edge(seam.first).curve.length, self.edge(seam.second).curve.length
            if abs(first - second) > SEAM_TOLERANCE:
                raise InputError(
                    f"pattern '{self.name}': seam edges do not match: {seam.first} is {first:.6f} m, "
                    f"{seam.second} is {second:.6f} m; they may differ by {SEAM_TOLERANCE:g} m, "
                    "so redraw one of them"
                )
            for ref in (seam.first, seam.second):
                if ref in used:
                    raise InputError(f"pattern '{self.name}': edge {ref} is sewn twice; an edge has one seam")
                used.add(ref)
