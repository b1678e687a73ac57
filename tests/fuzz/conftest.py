import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))  # for mutators.py, targets.py and harness.py, under importlib mode
