import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))  # for frf_runs.py, under importlib mode
