"""Concealed cases of described machines (exchange format 2), with independent equations, solver and effects.

No code is shared with plants/ or rtctl/diagnose. Seal, scores, reports and motions come from rtctl/proof.
"""

TOPOLOGIES = ("belt", "arm", "screw", "torsion", "pendulum", "hoist", "spindle", "gantry", "two-motor", "axis")
