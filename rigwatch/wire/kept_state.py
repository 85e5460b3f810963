"""A kernel's state that is passed once, for kernels that work on the states of many.

    state ──KeptState──▶ address ──▶ kernel: kept(like, address) ──▶ the same state

numba takes a named tuple of arrays apart at each call, which costs more than the work on some
samples. Here its native form is stored, and a kernel takes any number of addresses in one array.
"""

from typing import Any

import numpy as np
from llvmlite import ir
from numba import typeof
from numba.core import cgutils, types
from numba.extending import intrinsic

from rigwatch.wire.kernel import kernel

# Compiled functions are untyped to mypy.
# mypy: disable-error-code="no-untyped-call,no-any-return,misc"


class KeptState:
    """The native form of a state, and the state itself, which lives as long.

    Args:
        state: a named tuple of arrays, records, numbers and further such tuples. Its arrays may be
            written to, but numbers in it are those of now.

    Attributes:
        address: for `kept`, of a state of the same type, as long as this object lives.
        kind: names the state's type to numba; a kernel takes states of one kind.
    """

    def __init__(self, state: Any) -> None:
        self.state, self.kind = state, str(typeof(state))
        self._memory = np.zeros(_size(state), np.uint8)
        self.address = int(self._memory.ctypes.data)
        _store(state, self.address)


def _load(_context: Any, like: Any, address: Any) -> Any:
    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        return builder.load(_place(context, builder, signature.args[0], arguments[1]))

    return like(like, address), generate


def _write(_context: Any, state: Any, address: Any) -> Any:
    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        kind = signature.args[0]
        plain = _without_owners(context, builder, kind, arguments[0])
        builder.store(plain, _place(context, builder, kind, arguments[1]))
        return context.get_dummy_value()

    return types.void(state, address), generate


def _measure(_context: Any, state: Any) -> Any:
    def generate(context: Any, _builder: Any, signature: Any, _arguments: Any) -> Any:
        size = context.get_abi_sizeof(context.get_value_type(signature.args[0]))
        return ir.Constant(ir.IntType(64), size)

    return types.int64(state), generate


kept: Any = intrinsic(_load)
"""In a kernel: `kept(like, address)` is the state of the `KeptState` at `address`, of the type of
`like`.
"""
_stored: Any = intrinsic(_write)
_size_of: Any = intrinsic(_measure)


def _place(context: Any, builder: Any, kind: Any, address: Any) -> Any:
    return builder.inttoptr(address, context.get_value_type(kind).as_pointer())


def _without_owners(context: Any, builder: Any, kind: Any, value: Any) -> Any:
    """The value with arrays that own nothing: counting references does not apply to them."""
    if isinstance(kind, types.Array):
        array = context.make_array(kind)(context, builder, value)
        array.meminfo = cgutils.get_null_value(array.meminfo.type)
        array.parent = cgutils.get_null_value(array.parent.type)
        return array._getvalue()
    if isinstance(kind, types.BaseTuple):
        parts: Any = kind
        for place, part in enumerate(parts.types):
            found = builder.extract_value(value, place)
            plain = _without_owners(context, builder, part, found)
            value = builder.insert_value(value, plain, place)
    return value


@kernel()
def _size(state: Any) -> int:
    return _size_of(state)


@kernel()
def _store(state: Any, address: int) -> None:
    _stored(state, address)
