"""Compiled functions cached between runs and recompiled when anything in them changes.

    Python ──▶ kernel ──▶ parts, which only kernels and other parts call

numba's cache checks only the file in which a function is defined. Here the code and constants of
other files that are compiled into the function are part of the cache key too.

numba compiles a function anew for each constant that another one passes to it, and for every one a
way in from Python, which for a state of many arrays takes as long as the function. A part has
neither, and a kernel has one copy for all constants.

numba counts the references to each array that a function takes from a tuple or passes on, which for
a state of many arrays takes most of its time. Kernels and parts borrow the arrays of their caller
and count none, unless they say that they allocate: only these may make arrays or return them.
"""

import hashlib
from collections.abc import Callable, Iterator, Mapping
from types import CodeType, ModuleType
from typing import Any, TypeVar

import numpy as np
from numba import njit
from numba.core import types
from numba.core.caching import FunctionCache
from numba.core.dispatcher import Dispatcher
from numba.core.targetconfig import ConfigStack

_RULES = "arrays borrowed"
"""How functions are compiled; to be changed with it, since it is part of the cache's key."""
F = TypeVar("F", bound=Callable[..., Any])


def kernel(*, allocates: bool = False, **options: Any) -> Callable[[F], F]:
    """Decorator: compile with numba's `njit` and these options, and cache the result.

    Args:
        allocates: whether it makes arrays, returns one, or calls a part that returns one; without
            this, such a function is refused when it is compiled.
        options: of numba's `njit`.
    """

    def compiled(function: F) -> F:
        dispatcher = _compiled(function, {"_nrt": allocates, **options})
        dispatcher._cache = _KeyedByCode(function)  # type: ignore[no-untyped-call]
        return dispatcher  # type: ignore[no-any-return]

    return compiled


def part(*, allocates: bool = False, **options: Any) -> Callable[[F], F]:
    """Decorator: as `kernel`, for calls by kernels alone."""
    # What is inlined is compiled on its own only if Python calls it.
    options.setdefault("no_cpython_wrapper", options.get("inline") != "always")

    def compiled(function: F) -> F:
        return _compiled(function, {"_nrt": allocates, **options})  # type: ignore[no-any-return]

    return compiled


def _compiled(function: F, options: Mapping[str, Any]) -> Any:
    """The function for kernels, which takes a constant for any value of its type."""
    plain: Any = types.unliteral
    dispatcher: Any = njit(**{"no_cfunc_wrapper": True, **options})(function)
    original, add = dispatcher.get_call_template, dispatcher.add_overload

    def without_constants(arguments: Any, keywords: Any) -> Any:
        named = {name: plain(kind) for name, kind in keywords.items()}
        found = original(tuple(map(plain, arguments)), named)
        _check_owner(function, dispatcher)
        return found

    def checked(compiled: Any) -> None:
        if not options["_nrt"] and _holds_array(compiled.signature.return_type):
            raise TypeError(f"{function.__qualname__} returns an array: it has to say `allocates`")
        add(compiled)

    dispatcher.get_call_template, dispatcher.add_overload = without_constants, checked
    return dispatcher


def _check_owner(called: Callable[..., Any], dispatcher: Any) -> None:
    """An array that a part returns needs a caller that counts references, or it is never freed."""
    caller = ConfigStack.top_or_none()  # type: ignore[no-untyped-call]
    returned = (one.signature.return_type for one in dispatcher.overloads.values())
    if caller is not None and not caller.nrt and any(map(_holds_array, returned)):
        raise TypeError(
            f"what calls {called.__qualname__}, which returns an array, `allocates` too"
        )


def _holds_array(kind: types.Type) -> bool:
    """Whether a value of this type is an array, or a tuple with one."""
    if isinstance(kind, types.BaseTuple):
        return any(map(_holds_array, kind))  # type: ignore[call-overload]
    return isinstance(kind, types.Array)


class _KeyedByCode(FunctionCache):
    """numba's cache of one function, keyed by all code and constants compiled into it."""

    def load_overload(self, sig: object, target_context: object) -> object:
        """The compiled function; None, and an empty cache, if it names a class that is gone."""
        try:
            return super().load_overload(sig, target_context)  # type: ignore[no-untyped-call]
        except (AttributeError, ImportError):  # written by another version
            self.flush()  # type: ignore[no-untyped-call]
            return None

    def _index_key(self, sig: object, codegen: object) -> tuple[object, ...]:
        by_signature = super()._index_key(sig, codegen)  # type: ignore[no-untyped-call]
        return (*by_signature, fingerprint(self._py_func))


def fingerprint(function: Callable[..., object]) -> str:
    """SHA-256 of a function's code, its global constants, and the compiled functions it calls."""
    text = "\n".join((_RULES, *_parts(function, set())))
    return hashlib.sha256(text.encode()).hexdigest()


def _parts(function: Any, seen: set[object]) -> Iterator[str]:
    if function in seen:
        return
    seen.add(function)
    for code in _codes(function.__code__):
        constants = [c for c in code.co_consts if not isinstance(c, CodeType)]
        yield f"{code.co_name} {code.co_code.hex()} {code.co_names} {constants!r}"
        for name, value in _globals(code, function.__globals__):
            if isinstance(value, Dispatcher):
                yield f"{name} {sorted(value.targetoptions.items())}"
                yield from _parts(value.py_func, seen)
            elif (written := getattr(value, "_defn", None)) is not None:  # an intrinsic
                yield from _parts(written, seen)
            elif isinstance(value, np.ndarray):
                yield f"{name} {value.tolist()}"
            elif isinstance(value, (bool, int, float, str, tuple)):
                yield f"{name} {value!r}"
            else:
                yield f"{name} {getattr(value, '_fields', '')}"


def _codes(code: CodeType) -> Iterator[CodeType]:
    """A code object and those nested in it."""
    yield code
    for constant in code.co_consts:
        if isinstance(constant, CodeType):
            yield from _codes(constant)


def _globals(code: CodeType, known: Mapping[str, object]) -> Iterator[tuple[str, object]]:
    """The global names of a code object and their values, attributes of modules included."""
    for name in code.co_names:
        value = known.get(name)
        yield name, value
        if isinstance(value, ModuleType):
            yield from ((n, getattr(value, n)) for n in code.co_names if hasattr(value, n))
