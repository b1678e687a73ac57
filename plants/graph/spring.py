"""Springs and dampers between two coordinates, as rows of the linear model."""

from rtctl.idiom import tick


@tick
def spring(A, m, i, a, j, b, c, k):
    """Spring c and damper k of elongation a q_i + b q_j: add its force at both ends, by inertia, to A."""
    nq = m.nq
    wi, wj = 1.0 / m.inertia[i], 1.0 / m.inertia[j]
    A[nq + i, i] -= wi * a * a * c
    A[nq + i, j] -= wi * a * b * c
    A[nq + j, i] -= wj * b * a * c
    A[nq + j, j] -= wj * b * b * c
    A[nq + i, nq + i] -= wi * a * a * k
    A[nq + i, nq + j] -= wi * a * b * k
    A[nq + j, nq + i] -= wj * b * a * k
    A[nq + j, nq + j] -= wj * b * b * k
