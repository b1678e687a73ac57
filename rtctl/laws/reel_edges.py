"""Radius of one reel from the edges that its sensor counts while the tape runs one way.

    R = R_c |phi_b - phi_a| / ((n_b - n_a) angle)

The capstan angles phi_a and phi_b belong to the first and the last counted edge, each taken half-way through the tick
in which it came. The remaining quantisation error is half of the capstan's travel in a tick, instead of a whole count
of the reel as in the plain ratio.

Source: thesis 5.2; accuracy of the plain ratio in 5.3.
"""

from rtctl.idiom import state, tick

# count at the last tick, edges seen, count and capstan angle (rad) at the first and at the last edge
EDGES_STATE = state(n=int, seen=int, n_a=int, n_b=int, phi_a=float, phi_b=float)


@tick
def follow(s, phi_c, n_counts, count):
    """Note an edge at capstan angle `phi_c` rad where `n_counts` changed and `count` is 1; with 0 only keep up."""
    if count != 0 and n_counts != s.n:
        if s.seen == 0:
            s.n_a = n_counts
            s.phi_a = phi_c
        s.n_b = n_counts
        s.phi_b = phi_c
        s.seen += 1
    s.n = n_counts


@tick
def radius(s, R_c, angle):
    """Radius in m for a capstan of `R_c` m and `angle` rad per count; 0 before the second edge."""
    if s.seen < 2:
        return 0.0
    return R_c * abs(s.phi_b - s.phi_a) / (abs(s.n_b - s.n_a) * angle)


@tick
def clear(s):
    """Forget the edges; the next one is the first."""
    s.seen = 0
