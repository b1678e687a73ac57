"""Torque constant of a current-driven motor in the laws: volts to torque.

    tau = K_m amp_per_volt u

Source: thesis 7.2 (2 A at 10 V) and appendix A (K_m).
"""

from rtctl.idiom import Settings, quantity


class DriveSettings(Settings):
    """Base of the settings of every law that turns a torque into a voltage."""

    K_m: float = quantity(0.061, unit="Nm/A", gt=0, help="motor constant")
    amp_per_volt: float = quantity(0.2, unit="A/V", safer="larger", gt=0, help="gain of the motor driver")

    @property
    def torque_per_volt(self) -> float:
        """Nm per V."""
        return self.K_m * self.amp_per_volt
