"""Pattern files: JSON, schema version 1.

    {
      "format": "muslin-pattern", "schema_version": 1, "unit": "m",
      "name": "tee", "parameters": {"sleeve_length": 0.22, ...},
      "panels": [{"name": "front", "edges": [
          {"name": "hem", "start": [x, y], "controls": [[x, y], [x, y]]}, ...]}, ...],
      "seams": [["front.shoulder_left", "back.shoulder_left"], ...]
    }

The edges of a panel run counter-clockwise as seen from outside the garment, grain along +y; an edge ends
where the next one starts. It is straight without `controls`, a cubic Bezier curve with two. A seam names two
edges as "panel.edge"; they are sewn together in opposite directions.
"""

from __future__ import annotations

import json
import math
import os
from pathlib import Path
from typing import Any

from muslin.garments.curves import CubicBezier, Curve, Line, Point
from muslin.garments.errors import InputError
from muslin.garments.panels import Panel, PanelEdge
from muslin.garments.pattern import Pattern
from muslin.garments.seams import EdgeRef, Seam

FORMAT = "muslin-pattern"
SCHEMA_VERSION = 1


def write_pattern(pattern: Pattern, path: Path | str) -> None:
    """Write the pattern as JSON; reading it back gives an equal pattern. The file is replaced as a whole."""
    pattern.validate()
    content = {
        "format": FORMAT,
        "schema_version": SCHEMA_VERSION,
        "unit": "m",
        "name": pattern.name,
        "parameters": pattern.parameters,
        "panels": [
            {"name": panel.name, "edges": [_edge_entry(edge) for edge in panel.edges]}
            for panel in pattern.panels
        ],
        "seams": [[str(seam.first), str(seam.second)] for seam in pattern.seams],
    }
    path = Path(path)
    partial = path.with_name(path.name + ".partial")
    partial.write_text(json.dumps(content, indent=1) + "\n", encoding="utf-8")
    os.replace(partial, path)


def read_pattern(path: Path | str) -> Pattern:
    """The validated pattern in a JSON file; InputError names the file and the entry that is wrong."""
    path = Path(path)
    try:
        content = json.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise InputError(
            f"{path}: cannot be read: {error.strerror}; give the path of a pattern file"
        ) from error
    except (json.JSONDecodeError, UnicodeDecodeError) as error:
        raise InputError(f"{path} is not JSON: {error}") from error
    reader = _Reader(path)
    try:
        pattern = reader.pattern(content)
        pattern.validate()
    except InputError as error:
        raise error if str(error).startswith(str(path)) else InputError(f"{path}: {error}") from error
    return pattern


def _edge_entry(edge: PanelEdge) -> dict[str, Any]:
    entry: dict[str, Any] = {"name": edge.name, "start": list(edge.curve.start)}
    if isinstance(edge.curve, CubicBezier):
        entry["controls"] = [list(edge.curve.control_1), list(edge.curve.control_2)]
    return entry


class _Reader:
    """Turns parsed JSON into a pattern; every failure names the entry."""

    def __init__(self, path: Path) -> None:
        self.path = path

    def pattern(self, content: Any) -> Pattern:
        content = self.table(
            content,
            "the file",
            {"format", "schema_version", "name", "panels", "seams"},
            {"unit", "parameters"},
        )
        if content["format"] != FORMAT:
            self.fail("format", content["format"], f"'{FORMAT}'")
        if content["schema_version"] != SCHEMA_VERSION:
            self.fail(
                "schema_version",
                content["schema_version"],
                f"{SCHEMA_VERSION}; a newer file needs a newer muslin",
            )
        if content.get("unit", "m") != "m":
            self.fail("unit", content["unit"], "'m'; convert the coordinates to metres")
        parameters = content.get("parameters", {})
        if not isinstance(parameters, dict):
            self.fail("parameters", parameters, "a table of numbers")
        return Pattern(
            name=self.text(content["name"], "name"),
            panels=tuple(
                self.panel(entry, f"panels[{i}]")
                for i, entry in enumerate(self.items(content["panels"], "panels"))
            ),
            seams=tuple(
                self.seam(entry, f"seams[{i}]")
                for i, entry in enumerate(self.items(content["seams"], "seams"))
            ),
            parameters={key: self.number(value, f"parameters.{key}") for key, value in parameters.items()},
        )

    def panel(self, entry: Any, key: str) -> Panel:
        entry = self.table(entry, key, {"name", "edges"})
        edges = [
            self.table(edge, f"{key}.edges[{i}]", {"name", "start"}, {"controls"})
            for i, edge in enumerate(self.items(entry["edges"], f"{key}.edges"))
        ]
        starts = [self.point(edge["start"], f"{key}.edges[{i}].start") for i, edge in enumerate(edges)]
        built = []
        for i, edge in enumerate(edges):
            start, end = starts[i], starts[(i + 1) % len(starts)]
            curve: Curve = Line(start, end)
            if "controls" in edge:
                controls = self.items(edge["controls"], f"{key}.edges[{i}].controls")
                if len(controls) != 2:
                    self.fail(f"{key}.edges[{i}].controls", controls, "two points")
                first, second = (self.point(point, f"{key}.edges[{i}].controls") for point in controls)
                curve = CubicBezier(start, first, second, end)
            built.append(PanelEdge(self.text(edge["name"], f"{key}.edges[{i}].name"), curve))
        return Panel(self.text(entry["name"], f"{key}.name"), tuple(built))

    def seam(self, entry: Any, key: str) -> Seam:
        names = self.items(entry, key)
        refs = [str(name).split(".") for name in names]
        if len(refs) != 2 or any(len(ref) != 2 for ref in refs):
            self.fail(key, entry, 'two edges, each as "panel.edge"')
        return Seam(EdgeRef(*refs[0]), EdgeRef(*refs[1]))

    def table(
        self,
        entry: Any,
        key: str,
        required: set[str],
        optional: set[str] = frozenset(),  # type: ignore[assignment]
    ) -> dict[str, Any]:
        if not isinstance(entry, dict):
            self.fail(key, entry, "a table")
        for name in required - entry.keys():
            raise InputError(f"{self.path}: {key} lacks '{name}'; required: {', '.join(sorted(required))}")
        for name in entry.keys() - required - optional:
            allowed = ", ".join(sorted(required | optional))
            raise InputError(f"{self.path}: {key} has an unknown key '{name}'; allowed: {allowed}")
        return entry

    def items(self, entry: Any, key: str) -> list[Any]:
        if not isinstance(entry, list):
            self.fail(key, entry, "a list")
        return entry

    def text(self, entry: Any, key: str) -> str:
        if not isinstance(entry, str) or not entry or "." in entry:
            self.fail(key, entry, "a name, not empty and without a dot")
        return entry

    def number(self, entry: Any, key: str) -> float:
        if isinstance(entry, bool) or not isinstance(entry, (int, float)) or not math.isfinite(entry):
            self.fail(key, entry, "a finite number")
        return float(entry)

    def point(self, entry: Any, key: str) -> Point:
        if not isinstance(entry, list) or len(entry) != 2:
            self.fail(key, entry, "two numbers [x, y], metres")
        return (self.number(entry[0], key), self.number(entry[1], key))

    def fail(self, key: str, value: Any, allowed: str) -> None:
        shown = json.dumps(value)
        raise InputError(f"{self.path}: {key} = {shown[:60]} is not allowed; it must be {allowed}")
