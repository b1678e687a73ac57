"""Equal digits on every processor.

OpenBLAS, the linear algebra of numpy and scipy, has kernels for each processor. The kernels add in different orders,
so results differ in the last digits. A diagnosis ranks candidates of nearly equal likelihood, and the last digits can
change the ranking: the EMPS axis was `ambiguous` with the kernels for AVX-512 and `named` with those for AVX2. Nearly
every x86 processor since 2013 has AVX2.

Source: OpenBLAS, DYNAMIC_ARCH and the variable OPENBLAS_CORETYPE.
"""

import os
import platform
import sys
from collections.abc import MutableMapping
from pathlib import Path

VARIABLE, KERNELS = "OPENBLAS_CORETYPE", "Haswell"
NEEDED = {"avx2", "fma"}
FIRST = 8192  # bytes of /proc/cpuinfo that hold the flags of the first processor


def equal_digits(environment: MutableMapping[str, str] = os.environ, cpuinfo: Path = Path("/proc/cpuinfo")) -> None:
    """Choose the kernels for AVX2, in this process and those that it starts. A choice of the caller stays.

    No effect on another architecture, on a processor without AVX2, or once numpy is loaded.
    """
    if "numpy" in sys.modules or platform.machine() != "x86_64":
        return
    try:
        with cpuinfo.open() as file:
            flags = next((line for line in file.read(FIRST).splitlines() if line.startswith("flags")), "")
    except OSError:
        return
    if set(flags.split()) >= NEEDED:
        environment.setdefault(VARIABLE, KERNELS)
