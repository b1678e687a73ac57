import sys
from pathlib import Path

# for fused.py and filters.py, under importlib mode
sys.path[:0] = [str(Path(__file__).parents[1] / "machines"), str(Path(__file__).parent)]
