"""Texts for error and state numbers of CANSimple and of a CAN controller.

Source: ODriveArduino, ODriveEnums.h (firmware 0.6); linux/can/error.h.
"""

ERRORS = {
    0x1: "initializing",
    0x2: "system level",
    0x4: "timing error",
    0x8: "missing estimate",
    0x10: "bad config",
    0x20: "driver fault",
    0x40: "missing input",
    0x100: "bus voltage too high",
    0x200: "bus voltage too low",
    0x400: "bus current too high",
    0x800: "regenerated current too high",
    0x1000: "current limit violated",
    0x2000: "motor too hot",
    0x4000: "inverter too hot",
    0x8000: "speed limit violated",
    0x10000: "position limit violated",
    0x1000000: "its watchdog has expired",
    0x2000000: "emergency stop requested",
    0x4000000: "spinout detected",
    0x8000000: "brake resistor disarmed",
    0x10000000: "thermistor disconnected",
    0x40000000: "calibration error",
}
STATES = {
    0: "undefined",
    1: "idle",
    2: "in its startup sequence",
    3: "calibrating",
    4: "calibrating its motor",
    6: "searching the index of its encoder",
    7: "calibrating its encoder",
    9: "in a lock-in spin",
    11: "homing",
}
BUS_OFF, NO_ACK, BUS_ERROR = 0x40, 0x20, 0x80


def error_words(error: int) -> str:
    """Text for an axis error: its number and the names of its bits in firmware 0.6."""
    known = [words for bit, words in ERRORS.items() if error & bit]
    return f"error 0x{error:X}" + (f" ({', '.join(known)})" if known else "")


def state_words(state: int) -> str:
    """Text for an axis state."""
    return STATES.get(state, f"in state {state}")


def bus_words(errors: int) -> str:
    """Text for an error frame of the controller that ends a run; "" for an error from which the bus recovers."""
    if errors & BUS_OFF:
        return "the controller is off the bus after too many errors; check wires, termination and bit rate"
    if errors & NO_ACK:
        return "no node acknowledges; is the bus wired and powered?"
    return ""
