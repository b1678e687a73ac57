"""Dimensions of the numbers of terms, and their SI units where a node turns and where it slides."""

DIMENSIONS = {  # quantity: unit where a node turns, and where it slides
    "position": ("rad", "m"), "speed": ("rad/s", "m/s"), "force": ("Nm", "N"), "inertia": ("kg m^2", "kg"),
    "stiffness": ("Nm/rad", "N/m"), "square": ("Nm/rad^2", "N/m^2"), "cubic": ("Nm/rad^3", "N/m^3"),
    "drag": ("Nms/rad", "Ns/m"), "square_drag": ("Nm s^2/rad^2", "N s^2/m^2"), "per_force": ("1/Nm", "1/N"),
    "yield": ("rad/s/Nm", "m/s/N"),
}  # fmt: skip
BY_NODE = {  # dimension of a parameter by its name, where its term does not say
    "F_C": "force", "F_added": "force", "F_s": "force", "F": "force", "F_h": "force", "B": "drag", "B_a": "drag",
    "v_s": "speed",
    "z_s": "position", "z_h": "position", "gap": "position", "size": "position", "each": "position", "mark": "position",
    "at": "position", "width": "position", "x0": "position", "turn": "position", "mass": "inertia", "k": "stiffness",
    "c2": "square", "c3": "cubic", "Q": "square_drag",
}  # fmt: skip
