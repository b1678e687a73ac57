"""Concealed cases for described machines (exchange format 2): equations, solver and effects of their own.

No code is shared with plants/ or rtctl/diagnose. Seal, scores, reports and motions are those of rtctl/proof.
"""

TOPOLOGIES = ("belt", "arm", "screw", "torsion", "pendulum", "hoist", "spindle", "gantry", "two-motor", "axis")
