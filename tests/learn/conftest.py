"""Make the producers of samples importable."""

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1] / "sim" / "dataset"))
