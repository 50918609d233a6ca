"""A design: a named family of patterns with documented parameters."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

from muslin.garments.errors import InputError
from muslin.garments.pattern import Pattern


@dataclass(frozen=True)
class Parameter:
    """One design parameter with its closed range [low, high] and default."""

    name: str
    low: float
    high: float
    default: float
    unit: str
    description: str


@dataclass(frozen=True)
class Design:
    """A family of patterns with the same panels, edges and seams, drawn from parameters.

    draw: makes the pattern from a complete, checked parameter set.
    reference: the parameters of the member whose panels make the uv layout and carry the templates.
    presets: named parameter sets; parameters they leave out take their defaults.
    """

    name: str
    parameters: dict[str, Parameter]
    draw: Callable[[Mapping[str, float]], Pattern]
    reference: dict[str, float]
    presets: dict[str, dict[str, float]] = field(default_factory=dict)

    def complete(self, parameters: Mapping[str, float]) -> dict[str, float]:
        """All parameters, defaults filled in; InputError for an unknown one or a value out of range."""
        for key in parameters:
            if key not in self.parameters:
                raise InputError(
                    f"design '{self.name}' has no parameter '{key}'; allowed: {', '.join(self.parameters)}"
                )
        complete = {}
        for key, parameter in self.parameters.items():
            given = parameters.get(key, parameter.default)
            try:
                value = float(given)
            except (TypeError, ValueError):
                value = math.nan
            if not parameter.low <= value <= parameter.high:
                raise InputError(
                    f"design '{self.name}': {key} = {given} is out of range; "
                    f"allowed: {parameter.low:g} to {parameter.high:g} {parameter.unit}"
                )
            complete[key] = value
        return complete

    def preset(self, name: str) -> dict[str, float]:
        """Complete parameters of a preset; InputError if there is none of that name."""
        if name not in self.presets:
            raise InputError(
                f"design '{self.name}' has no preset '{name}'; allowed: {', '.join(self.presets)}"
            )
        return self.complete(self.presets[name])

    def pattern(self, **parameters: float) -> Pattern:
        """The pattern with these parameters (metres), defaults for the rest; InputError as `complete`."""
        return self.draw(self.complete(parameters))
