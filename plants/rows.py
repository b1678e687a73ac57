"""Weighted sum of rows of matrices, LANES columns side by side in vector registers.

    out[i] = sum_j P[j, i] x[j] + sum_j G[j, i] u[j] + sum_j G[nu + j, i] f[j]

Every column adds up in the order of j, each product rounded before it is added, so that the bits are those of a plain
loop. Compiled code gets its vector instructions from here, since numba makes none of sums that stay in registers. Rows
are contiguous and as long as a multiple of LANES; what lies between n and the next multiple is filled as well.
"""

from collections.abc import Callable
from typing import Any

from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.extending import intrinsic, overload

LANES = 16  # columns at once: two registers of AVX-512, four of AVX2
WIDE = ir.VectorType(ir.DoubleType(), LANES)
FIRST = ir.Constant(ir.VectorType(ir.IntType(32), LANES), [0] * LANES)


def sum_rows(out: Any, n: int, P: Any, x: Any, nx: int, G: Any, u: Any, nu: int, f: Any, nf: int) -> None:
    """Fill out[:n] from nx rows of P, the first nu of G, and nf more of G."""
    for i in range(n):
        a = 0.0
        for j in range(nx):
            a += P[j, i] * x[j]
        for j in range(nu):
            a += G[j, i] * u[j]
        for j in range(nf):
            a += G[nu + j, i] * f[j]
        out[i] = a


@overload(sum_rows, inline="always")
def _sum_rows(out, n, P, x, nx, G, u, nu, f, nf):
    return lambda out, n, P, x, nx, G, u, nu, f, nf: _sum(out, n, P, x, nx, G, u, nu, f, nf)  # type: ignore[call-arg]


class _Code:
    """Instructions of one call."""

    def __init__(self, context: Any, builder: Any, signature: Any, args: Any):
        self.context, self.builder, self.types, self.args = context, builder, signature.args, args

    def whole(self, k: int) -> Any:
        """Argument k as an index."""
        return self.context.cast(self.builder, self.args[k], self.types[k], types.intp)

    def data(self, k: int) -> Any:
        """Address of the first number of array k."""
        return self._array(k).data

    def length(self, k: int) -> Any:
        """Length of a row of matrix k."""
        return cgutils.unpack_tuple(self.builder, self._array(k).shape, 2)[1]

    def _array(self, k: int) -> Any:
        return self.context.make_array(self.types[k])(self.context, self.builder, self.args[k])

    def load(self, base: Any, at: Any) -> Any:
        """LANES numbers."""
        return self.builder.load(self._wide(base, at), align=8)

    def store(self, value: Any, base: Any, at: Any) -> None:
        """LANES numbers."""
        self.builder.store(value, self._wide(base, at), align=8)

    def _wide(self, base: Any, at: Any) -> Any:
        return self.builder.bitcast(self.builder.gep(base, [at]), WIDE.as_pointer())

    def spread(self, number: Any) -> Any:
        """The same number in all lanes."""
        empty = ir.Constant(WIDE, ir.Undefined)
        return self.builder.shuffle_vector(
            self.builder.insert_element(empty, number, ir.Constant(ir.IntType(32), 0)), empty, FIRST
        )

    def loop(self, stop: Any, step: int, total: Any, body: Callable[[Any, Any], Any]) -> Any:
        """Run `body(i, total)` for i = 0, step, ... below `stop`; the last total, None where there is none."""
        b, before = self.builder, self.builder.block
        head, inner, end = (b.append_basic_block(name) for name in ("rows", "row", "rows_end"))
        b.branch(head)
        b.position_at_end(head)
        i = b.phi(stop.type)
        i.add_incoming(ir.Constant(stop.type, 0), before)
        kept = None
        if total is not None:
            kept = b.phi(WIDE)
            kept.add_incoming(total, before)
        b.cbranch(b.icmp_signed("<", i, stop), inner, end)
        b.position_at_end(inner)
        new = body(i, kept)
        i.add_incoming(b.add(i, ir.Constant(stop.type, step)), b.block)
        if kept is not None:
            kept.add_incoming(new, b.block)
        b.branch(head)
        b.position_at_end(end)
        return kept

    def summed(self, total: Any, P: int, first: Any, weights: int, count: Any, at: Any) -> Any:
        """`total` and `count` rows of matrix P from row `first`, each times its weight."""
        b, rows, length, numbers = self.builder, self.data(P), self.length(P), self.data(weights)

        def one(j: Any, kept: Any) -> Any:
            row = b.add(b.mul(b.add(first, j), length), at)
            return b.fadd(kept, b.fmul(self.load(rows, row), self.spread(b.load(b.gep(numbers, [j])))))

        return self.loop(count, 1, total, one)


@intrinsic
def _sum(typingctx, out, n, P, x, nx, G, u, nu, f, nf):
    def codegen(context, builder, signature, args):
        code = _Code(context, builder, signature, args)
        zero, nu_ = ir.Constant(ir.IntType(64), 0), code.whole(7)

        def lanes(at, _):
            total = code.summed(ir.Constant(WIDE, [0.0] * LANES), 2, zero, 3, code.whole(4), at)
            total = code.summed(total, 5, zero, 6, nu_, at)
            code.store(code.summed(total, 5, nu_, 8, code.whole(9), at), code.data(0), at)

        code.loop(code.whole(1), LANES, None, lanes)
        return context.get_dummy_value()

    return types.void(out, n, P, x, nx, G, u, nu, f, nf), codegen
