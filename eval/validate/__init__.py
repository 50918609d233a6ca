"""The validation suite: the simulator against known solutions, case by case."""
