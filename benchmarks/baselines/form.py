"""diagnosis.json of a baseline."""

from typing import Any

AXES = {
    "friction.coulomb": "velocity", "friction.viscous": "velocity", "friction.stribeck": "velocity",
    "friction.presliding": "position", "friction.asymmetry": "velocity", "friction.load": "tension",
    "drive.offset": "command", "drive.deadband": "command", "drive.gain_asymmetry": "command",
    "drive.saturation": "command", "drive.lag": "frequency", "drive.supply_sag": "command", "drive.thermal": "time",
    "timing.delay": "frequency", "ripple.cogging": "angle", "ripple.reel": "angle", "load.imbalance": "angle",
    "load.spring": "position", "load.bump": "position", "transmission.backlash": "velocity",
    "geometry.radius_change": "position",
}  # fmt: skip
MAIN = {"ivu": "capstan_counts", "ldu": "encoder_counts", "axis": "x"}
NODES = {  # node of a family of effects for methods with one equation
    "ivu": {"friction": "motor1", "drive": "drive1", "ripple": "motor1", "load": "capstan", "timing": "loop",
            "geometry": "reel1", "transmission": "capstan"},
    "ldu": {"friction": "motor", "drive": "drive", "ripple": "motor", "load": "carriage", "timing": "loop",
            "transmission": "wheel"},
    "axis": {"friction": "carriage", "drive": "drive", "ripple": "carriage", "load": "carriage", "timing": "loop",
             "transmission": "carriage"},
}  # fmt: skip


def node_of(plant: str, name: str) -> str:
    """Node of an effect name."""
    return "reel1" if name == "ripple.reel" else NODES[plant].get(name.partition(".")[0], "loop")


def diagnosis(plant: str, names: list[str], unnamed: bool = False, confidence: float = 0.9) -> dict[str, Any]:
    """Diagnosis with verdict `named` and these names; without names, `unnamed` or `nothing`."""
    verdict = "named" if names else "unnamed" if unnamed else "nothing"
    located = None
    if names or unnamed:
        first = names[0] if names else ""
        located = {
            "channel": MAIN[plant], "node": node_of(plant, first) if first else "loop",
            "axis": AXES.get(first, "time"), "where": "", "since_s": 0.0, "share": 1.0,
        }  # fmt: skip
    effects = [
        {"name": n, "node": node_of(plant, n), "confidence": confidence, "parameters": {}, "look_alikes": []}
        for n in names[:3]
    ]
    return {
        "verdict": verdict, "effects": effects, "located": located, "parameters": {}, "fit": {}, "cannot_test": [],
        "separating_experiment": None,
    }  # fmt: skip
