"""The cases of examples/real are a module of that folder."""

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[2] / "examples" / "real"))  # for real_cases.py, under importlib mode
