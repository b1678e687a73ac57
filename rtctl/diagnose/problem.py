"""A recording as a fit sees it: the errors of a simulation that follows it, what they weigh, what noise leaves of them.

Source: Ljung, System Identification (1999), ch. 7 for the prediction error in closed loop.
"""

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    pass

TOGETHER = 100.0  # errors that count as one
