"""Memory shared between supervisor, loop and plant: one file of named numpy records, and memory fences.

A segment is a file in /dev/shm. It outlives its process, so that the last seconds before a crash can be read.
"""

import mmap
import os
from pathlib import Path
from typing import Any

import numpy as np
from llvmlite import ir
from numba import extending, types

intrinsic: Any = extending.intrinsic  # Any: its annotations are wrong about the first argument
ALIGN = 64  # bytes, one cache line: two writers never share a line


@intrinsic
def fence(typing_context):
    """Full memory fence: reads and writes before it take effect before those after it."""

    def codegen(context, builder, signature, args):
        builder.fence("seq_cst")
        return ir.Constant(ir.IntType(64), 0)

    return types.int64(), codegen


@intrinsic
def release(typing_context):
    """Release fence: writes before it are visible before writes after it. No cost on x86."""

    def codegen(context, builder, signature, args):
        builder.fence("release")
        return ir.Constant(ir.IntType(64), 0)

    return types.int64(), codegen


@intrinsic
def borrowed(typing_context, array):
    """View of an array without reference counting, for use inside the tick.

    Each count is an atomic instruction; the counts took half the time of a fused tick. The caller of the compiled loop
    keeps the arrays alive.
    """

    def codegen(context, builder, signature, args):
        view = context.make_array(signature.args[0])(context, builder, args[0])
        view.meminfo = ir.Constant(view.meminfo.type, None)
        view.parent = ir.Constant(view.parent.type, None)
        return view._getvalue()

    return array(array), codegen


class Segment:
    """Named arrays of records in one shared file.

    `Segment.create(path, {"status": (STATUS, 1), ...})` makes it, zeroed; `Segment.open(path, same layout)` maps it in
    another process. `create` raises FileExistsError for an existing file, OSError where memory is short.
    `open` raises FileNotFoundError without a file, ValueError where its size does not fit the layout.
    """

    def __init__(self, path: Path, layout: dict[str, tuple[np.dtype, int]], buffer: mmap.mmap):
        self.path = path
        self._buffer = buffer
        self._arrays: dict[str, np.ndarray] = {}
        offset = 0
        for name, (dtype, count) in layout.items():
            self._arrays[name] = np.frombuffer(buffer, dtype, count, offset)
            offset = _aligned(offset + dtype.itemsize * count)

    @classmethod
    def create(cls, path: Path, layout: dict[str, tuple[np.dtype, int]]) -> "Segment":
        size = _size(layout)
        path.parent.mkdir(parents=True, exist_ok=True)
        fd = os.open(path, os.O_CREAT | os.O_EXCL | os.O_RDWR | os.O_NOFOLLOW | os.O_CLOEXEC, 0o600)
        try:
            os.posix_fallocate(fd, 0, size)  # a full file system raises an error here, not SIGBUS during a tick
            return cls(path, layout, mmap.mmap(fd, size))
        except BaseException:
            path.unlink()
            raise
        finally:
            os.close(fd)

    @classmethod
    def open(cls, path: Path, layout: dict[str, tuple[np.dtype, int]]) -> "Segment":
        fd = os.open(path, os.O_RDWR)
        try:
            size = os.fstat(fd).st_size
            if size != _size(layout):
                raise ValueError(
                    f"{path}: {size} bytes, but this config needs {_size(layout)}; it is of another version"
                )
            return cls(path, layout, mmap.mmap(fd, size))
        finally:
            os.close(fd)

    def __getitem__(self, name: str) -> Any:
        return self._arrays[name]

    def unlink(self) -> None:
        self.path.unlink(missing_ok=True)


def _aligned(offset: int) -> int:
    return (offset + ALIGN - 1) // ALIGN * ALIGN


def _size(layout: dict[str, tuple[np.dtype, int]]) -> int:
    return sum(_aligned(dtype.itemsize * count) for dtype, count in layout.values())
