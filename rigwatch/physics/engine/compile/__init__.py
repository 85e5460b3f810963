"""Compiles equations to machine code: exact derivatives, LLVM kernels, integration steps.

    System ──derivatives──▶ llvm ──▶ kernel: simulate, linearise (integrator)

The rest of the engine calls `CompiledSystem`; `step_size` gives the integration step of each
interval.
"""

from rigwatch.physics.engine.compile.all_cores import cores, on_all_cores, shares
from rigwatch.physics.engine.compile.compiled_system import (
    CompiledSystem,
    Linearisation,
    Simulation,
    compile_system,
    elapsed,
)
from rigwatch.physics.engine.compile.derivatives import derivative
from rigwatch.physics.engine.compile.integrator import across, call, input_rows, place
from rigwatch.physics.engine.compile.resolved_rates import rate_limit, resolved, resolved_from
from rigwatch.physics.engine.compile.stability import even_substeps
from rigwatch.physics.engine.compile.static_kernel import evaluated, numpy_function
from rigwatch.physics.engine.compile.step_size import INSTANT
from rigwatch.physics.engine.compile.turns import side_by_side, together

__all__ = [
    "INSTANT",
    "CompiledSystem",
    "Linearisation",
    "Simulation",
    "across",
    "call",
    "compile_system",
    "cores",
    "derivative",
    "elapsed",
    "evaluated",
    "even_substeps",
    "input_rows",
    "numpy_function",
    "on_all_cores",
    "place",
    "rate_limit",
    "resolved",
    "resolved_from",
    "shares",
    "side_by_side",
    "together",
]
