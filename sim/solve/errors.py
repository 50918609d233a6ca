"""The exception of a simulation that cannot go on."""


class SimulationError(Exception):
    """The solver cannot continue: says at which frame and element, why, and what to try."""
