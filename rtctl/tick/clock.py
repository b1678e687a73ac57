"""Monotonic clock and sleep for compiled code, in ns as 64-bit integers."""

from llvmlite import ir
from numba import types
from numba.core import cgutils

from rtctl.tick.memory import intrinsic

CLOCK_MONOTONIC = 1
CLOCK_BOOTTIME = 7  # CLOCK_MONOTONIC and the time that the computer was suspended
TIMER_ABSTIME = 1
SECOND = 1_000_000_000

_I32, _I64 = ir.IntType(32), ir.IntType(64)
_TIMESPEC = ir.LiteralStructType([_I64, _I64])
_POINTER = _TIMESPEC.as_pointer()


def _read(builder, which):
    """LLVM code that reads the clock `which`, ns."""
    function = cgutils.get_or_insert_function(builder.module, ir.FunctionType(_I32, [_I32, _POINTER]), "clock_gettime")
    spec = cgutils.alloca_once(builder, _TIMESPEC)
    builder.call(function, [ir.Constant(_I32, which), spec])
    seconds = builder.load(cgutils.gep_inbounds(builder, spec, 0, 0))
    return builder.add(
        builder.mul(seconds, ir.Constant(_I64, SECOND)), builder.load(cgutils.gep_inbounds(builder, spec, 0, 1))
    )


@intrinsic
def now(typing_context):
    """Time in ns: clock_gettime(CLOCK_MONOTONIC), a vDSO call without a system call."""

    def codegen(context, builder, signature, args):
        return _read(builder, CLOCK_MONOTONIC)

    return types.int64(), codegen


@intrinsic
def boot(typing_context):
    """Time in ns that includes the time in suspend: clock_gettime(CLOCK_BOOTTIME)."""

    def codegen(context, builder, signature, args):
        return _read(builder, CLOCK_BOOTTIME)

    return types.int64(), codegen


@intrinsic
def sleep_until(typing_context, wake):
    """Sleep until the absolute time `wake`, ns, without drift: clock_nanosleep(TIMER_ABSTIME). Returns 0, or EINTR."""

    def codegen(context, builder, signature, args):
        function = cgutils.get_or_insert_function(
            builder.module, ir.FunctionType(_I32, [_I32, _I32, _POINTER, _POINTER]), "clock_nanosleep"
        )
        spec = cgutils.alloca_once(builder, _TIMESPEC)
        second = ir.Constant(_I64, SECOND)
        builder.store(builder.sdiv(args[0], second), cgutils.gep_inbounds(builder, spec, 0, 0))
        builder.store(builder.srem(args[0], second), cgutils.gep_inbounds(builder, spec, 0, 1))
        result = builder.call(
            function,
            [ir.Constant(_I32, CLOCK_MONOTONIC), ir.Constant(_I32, TIMER_ABSTIME), spec, ir.Constant(_POINTER, None)],
        )
        return builder.sext(result, _I64)

    return types.int64(types.int64), codegen
