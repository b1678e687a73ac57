"""How fast, far and hard nodes move, on motions that can be worked out by hand."""

import numpy as np

A, W = 0.02, 2 * np.pi  # m or rad, rad/s
