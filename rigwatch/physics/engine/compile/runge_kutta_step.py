"""A whole Runge-Kutta step of a system in machine code, with its rates inlined.

A call per stage and loops over states of unknown number cost several times as much as the rates of
a small system. Here the state and its sensitivities stay in registers. The order of operations, and
so every bit of the result, is that of the loops

    k1 = f(t, z),   k2 = f(t + h/2, z + h/2·k1),   k3 = f(t + h/2, z + h/2·k2)
    k4 = f(t + h, z + h·k3),   z + (((h/6·k1 + h/3·k2) + h/3·k3) + h/6·k4)
"""

from collections.abc import Iterator

from rigwatch.physics.engine.compile.llvm import ARGUMENTS

STAGES = ((0, "half"), (1, "half"), (1, "h"), (2, ""))
"""Time and inputs of each stage (start, middle, end), and the step from z to the next stage."""


def step_function(name: str, rates: str, states: int, columns: int, inputs: int) -> str:
    """The code of `name`, one step of the function called `rates`.

    In `name`, a = z = [x | S] is updated; u has three rows of inputs, at the start, in the middle
    and at the end of the step; out = (start, middle, end, length) in seconds.

    Args:
        name: of the new function.
        rates: of the function of the same module with out = dz/dt.
        states: number of states.
        columns: number of sensitivities of each state; 0 for none.
        inputs: number of entries in a row of `u`.
    """
    lines = list(_lines(rates, states, columns, inputs))
    body = "\n".join(f"  {line}" for line in lines)
    return f"define void @{name}({ARGUMENTS}) {{\n{body}\n  ret void\n}}\n"


def _lines(rates: str, states: int, columns: int, inputs: int) -> Iterator[str]:
    size = states * (1 + columns)
    yield from (f"%{name} = alloca [{size} x double], align 8" for name in ("dz", "zs"))
    for index, name in enumerate(("t0", "t1", "t2", "h")):
        yield f"%{name}p = getelementptr inbounds double, ptr %out, i64 {index}"
        yield f"%{name} = load double, ptr %{name}p"
    yield "%half = fmul double 5.0e-1, %h"
    yield "%sixth = fdiv double %h, 6.0e0"
    yield "%third = fdiv double %h, 3.0e0"
    for index in range(3):
        yield f"%u{index} = getelementptr inbounds double, ptr %u, i64 {index * inputs}"
    pieces = _pieces(states, columns)
    for at, width in pieces:
        yield from _loaded(f"z{at}", "%a", at, width)
    for width in sorted({width for _, width in pieces}):
        for name in ("half", "sixth", "third", "h"):
            yield from _wide(name, width)
    for stage, (when, ahead) in enumerate(STAGES):
        arriving = "%zs" if stage else "%a"
        yield (
            f"call void @{rates}(double %t{when}, ptr {arriving}, ptr %u{when}, ptr %p, ptr %dz,"
            " ptr %dz)"
        )
        for at, width in pieces:
            yield from _after(stage, ahead, at, width)


def _after(stage: int, ahead: str, at: int, width: int) -> Iterator[str]:
    """The weighted sum of the slopes of one piece, and where the next stage stands."""
    kind, name = _kind(width), f"s{stage}p{at}"
    share = "sixth" if stage in {0, 3} else "third"
    yield from _loaded(f"{name}k", "%dz", at, width)
    yield f"%{name}w = fmul {kind} %{share}{width}, %{name}k"
    total = f"%{name}w"
    if stage:
        yield f"%{name}a = fadd {kind} %s{stage - 1}p{at}total, {total}"
        total = f"%{name}a"
    if ahead:
        yield f"%{name}m = fmul {kind} %{ahead}{width}, %{name}k"
        yield f"%{name}n = fadd {kind} %z{at}, %{name}m"
        yield from _stored(f"%{name}n", f"{name}q", "%zs", at, width)
        # A name for the sum so far, whichever instruction made it.
        yield f"%{name}total = bitcast {kind} {total} to {kind}"
    else:
        yield f"%{name}z = fadd {kind} %z{at}, {total}"
        yield from _stored(f"%{name}z", f"{name}q", "%a", at, width)


def _pieces(states: int, columns: int) -> list[tuple[int, int]]:
    """First entry and width of the states, one by one, and of the rows of their sensitivities."""
    rows = range(states) if columns else ()
    return [(i, 1) for i in range(states)] + [(states + i * columns, columns) for i in rows]


def _kind(width: int) -> str:
    return "double" if width == 1 else f"<{width} x double>"


def _wide(name: str, width: int) -> Iterator[str]:
    """A number in all entries of a piece."""
    kind, wide = _kind(width), f"%{name}{width}"
    if width == 1:
        yield f"{wide} = bitcast double %{name} to double"
        return
    yield f"{wide}i = insertelement {kind} poison, double %{name}, i32 0"
    yield (f"{wide} = shufflevector {kind} {wide}i, {kind} poison, <{width} x i32> zeroinitializer")


def _loaded(name: str, array: str, at: int, width: int) -> Iterator[str]:
    yield f"%{name}p = getelementptr inbounds double, ptr {array}, i64 {at}"
    yield f"%{name} = load {_kind(width)}, ptr %{name}p, align 8"


def _stored(value: str, name: str, array: str, at: int, width: int) -> Iterator[str]:
    yield f"%{name} = getelementptr inbounds double, ptr {array}, i64 {at}"
    yield f"store {_kind(width)} {value}, ptr %{name}, align 8"
