"""Kernels run by the interpreter: the same source, without seconds of compilation."""

from types import SimpleNamespace

from rigwatch.physics.engine.codegen import source
from rigwatch.physics.engine.compiled import CompiledSystem, compile_system
from rigwatch.physics.engine.system import System


def interpret(system: System) -> CompiledSystem:
    """The system with its kernel as plain Python."""
    if not system.states:
        return compile_system(system)
    text = "\n".join(x for x in source(system).splitlines() if not x.startswith("@njit"))
    names: dict[str, object] = {}
    exec(compile(text, "kernel", "exec"), names)
    return CompiledSystem(system, SimpleNamespace(**names))
