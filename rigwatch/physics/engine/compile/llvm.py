"""Translates expressions to LLVM code and compiles it to machine code in milliseconds.

The equations are straight-line code in double precision, for which numba's type inference would
take seconds. The loops around them (`integrator`) use numba and are compiled once for all systems.

Each function has the signature void(double t, double* a, u, p, out, slopes).
"""

import struct
from collections.abc import Callable, Mapping, Sequence
from functools import cache
from typing import Any

import llvmlite.binding as llvm
import sympy

from rigwatch.wire.errors import ModelError

FUNCTIONS = ("tanh", "exp", "log", "sin", "cos", "atan", "pow")
"""Functions called from the C mathematics library."""
INLINED = 250
"""Most instructions of a function that is inlined where it is called."""
_RELATIONS: dict[type[sympy.Basic], str] = {
    sympy.StrictGreaterThan: "ogt",
    sympy.GreaterThan: "oge",
    sympy.StrictLessThan: "olt",
    sympy.LessThan: "ole",
    sympy.Equality: "oeq",
    sympy.Unequality: "une",
}
_DECLARED = "".join(
    [
        *(f"declare double @{name}(double) nounwind memory(none)\n" for name in FUNCTIONS[:-1]),
        "declare double @pow(double, double) nounwind memory(none)\n",
        *(f"declare double @llvm.{name}.f64(double)\n" for name in ("fabs", "floor", "sqrt")),
    ]
)
ARGUMENTS = "double %t, " + ", ".join(
    f"ptr noalias captures(none) %{name}" for name in ("a", "u", "p", "out", "slopes")
)


class Function:
    """The code of one function under construction.

    Args:
        name: of the function.
        places: array and index from which each symbol is loaded; None for the time.
        known: symbols with constant values.
    """

    def __init__(
        self,
        name: str,
        places: Mapping[sympy.Symbol, tuple[str, int] | None],
        known: Mapping[sympy.Symbol, float],
    ) -> None:
        self._name, self._places, self._lines = name, places, list[str]()
        self._values: dict[sympy.Basic, str] = {s: literal(v) for s, v in known.items()}

    def text(self) -> str:
        """The whole function."""
        body = "\n".join(f"  {line}" for line in self._lines)
        inlined = " alwaysinline" if len(self._lines) <= INLINED else ""
        return f"define void @{self._name}({ARGUMENTS}){inlined} {{\n{body}\n  ret void\n}}\n"

    def let(self, name: sympy.Symbol, expression: sympy.Expr) -> None:
        """Name a value for reuse."""
        truth = isinstance(expression, sympy.logic.boolalg.Boolean)
        self._values[name] = self._condition(expression) if truth else self.value(expression)

    def store(self, array: str, index: int, value: str) -> None:
        """Write an element of an array."""
        self._lines.append(f"store double {value}, ptr {self._at(array, index)}")

    def load_row(self, array: str, first: int, width: int) -> str:
        """Load adjacent elements as one vector."""
        return self._do(f"load <{width} x double>, ptr {self._at(array, first)}, align 8")

    def store_row(self, array: str, first: int, row: str, width: int) -> None:
        """Store a vector to adjacent elements."""
        place = self._at(array, first)
        self._lines.append(f"store <{width} x double> {row}, ptr {place}, align 8")

    def row(self, values: Sequence[str | None], width: int) -> str:
        """A vector that starts with `values`, padded with zeros."""
        row = "zeroinitializer"
        for index, value in enumerate(values):
            if value is not None:
                row = self._inserted(row, value, index, width)
        return row

    def add_scaled(self, row: str, scale: str, other: str, width: int) -> str:
        """row + scale·other."""
        kind = f"<{width} x double>"
        # LLVM's idiom for a scalar in all elements of a vector.
        one = self._inserted("poison", scale, 0, width)
        wide = self._do(
            f"shufflevector {kind} {one}, {kind} poison, <{width} x i32> zeroinitializer"
        )
        product = self._do(f"fmul {kind} {wide}, {other}")
        return product if row == "zeroinitializer" else self._do(f"fadd {kind} {row}, {product}")

    def product(self, one: str, other: str) -> str:
        """one·other."""
        return self._op("fmul", one, other)

    def share(self, array: str, index: int, sizes: Sequence[str]) -> str:
        """The largest factor up to 1 that takes none of `sizes` beyond an element of an array."""
        limit = self._do(f"load double, ptr {self._at(array, index)}")
        first, *rest = (self._call("llvm.fabs.f64", size) for size in sizes)
        for other in rest:
            first = self._selected(self._compared("ogt", other, first), other, first)
        beyond = self._compared("ogt", first, limit)
        return self._selected(beyond, self._op("fdiv", limit, first), literal(1.0))

    def _inserted(self, row: str, value: str, index: int, width: int) -> str:
        return self._do(f"insertelement <{width} x double> {row}, double {value}, i32 {index}")

    def _op(self, operation: str, one: str, other: str) -> str:
        return self._do(f"{operation} double {one}, {other}")

    def value(self, expression: sympy.Basic) -> str:
        """The register that holds the value of an expression.

        Raises:
            ModelError: it cannot be computed numerically.
        """
        found = self._values.get(expression)
        if found is None:
            found = self._values[expression] = self._printed(expression)
        return found

    def _do(self, instruction: str) -> str:
        register = f"%r{len(self._lines)}"
        self._lines.append(f"{register} = {instruction}")
        return register

    def _at(self, array: str, index: int) -> str:
        return self._do(f"getelementptr inbounds double, ptr %{array}, i64 {index}")

    def _call(self, name: str, *arguments: str) -> str:
        return self._do(f"call double @{name}({', '.join(f'double {a}' for a in arguments)})")

    def _printed(self, e: sympy.Basic) -> str:  # noqa: PLR0911 -- one a kind of expression
        if isinstance(e, sympy.Symbol):
            place = self._places[e]
            return "%t" if place is None else self._do(f"load double, ptr {self._at(*place)}")
        if e.is_number:
            return literal(float(e))
        if isinstance(e, sympy.Add):
            return self._folded("fadd", e.args)
        if isinstance(e, sympy.Mul):
            return self._product(e)
        if isinstance(e, sympy.Pow):
            return self._power(e.base, e.exp)
        if isinstance(e, sympy.Max | sympy.Min):
            return self._extreme("ogt" if isinstance(e, sympy.Max) else "olt", e.args)
        if isinstance(e, sympy.Piecewise):
            return self._choice(e)
        if isinstance(e, sympy.Heaviside):
            return self._step(e)
        return self._function(e)

    def _folded(self, operation: str, terms: Sequence[sympy.Basic]) -> str:
        total = self.value(terms[0])
        for term in terms[1:]:
            total = self._op(operation, total, self.value(term))
        return total

    def _product(self, e: sympy.Mul) -> str:
        # A single division for all factors below the line, as it is the slowest operation.
        above: list[sympy.Basic] = []
        below: list[sympy.Basic] = []
        for factor in e.args:
            inverse = isinstance(factor, sympy.Pow) and factor.exp.is_number and factor.exp < 0
            (below if inverse else above).append(1 / factor if inverse else factor)
        top = self._folded("fmul", above) if above else literal(1.0)
        return self._op("fdiv", top, self._folded("fmul", below)) if below else top

    def _power(self, base: sympy.Expr, exponent: sympy.Expr) -> str:
        if exponent.is_number and exponent < 0:
            return self._op("fdiv", literal(1.0), self.value(sympy.Pow(base, -exponent)))
        if exponent == sympy.Rational(1, 2):
            return self._call("llvm.sqrt.f64", self.value(base))
        # `pow` is far slower than a root, and roots and squares are shared with other powers.
        if exponent.is_Rational and exponent.q == 2:
            whole = self.value(sympy.Pow(base, exponent - sympy.Rational(1, 2)))
            return self._op("fmul", whole, self.value(sympy.sqrt(base)))
        if exponent.is_Integer and exponent <= 16:
            half = self.value(sympy.Pow(base, exponent // 2))
            square = self._op("fmul", half, half)
            return self._op("fmul", square, self.value(base)) if exponent % 2 else square
        return self._call("pow", self.value(base), self.value(exponent))

    def _extreme(self, relation: str, terms: Sequence[sympy.Basic]) -> str:
        found = self.value(terms[0])
        for term in terms[1:]:
            other = self.value(term)
            found = self._selected(self._compared(relation, other, found), other, found)
        return found

    def _choice(self, e: sympy.Piecewise) -> str:
        # All branches are computed and one is selected: without jumps the code is vectorised.
        found = literal(float("nan"))
        for value, condition in reversed(e.args):
            if condition == sympy.true:
                found = self.value(value)
            else:
                found = self._selected(self._condition(condition), self.value(value), found)
        return found

    def _step(self, e: sympy.Heaviside) -> str:
        positive = self._compared("ogt", self.value(e.args[0]), literal(0.0))
        return self._selected(positive, literal(1.0), literal(0.0))

    def _condition(self, e: sympy.Basic) -> str:
        if e in self._values:
            return self._values[e]
        if isinstance(e, sympy.And | sympy.Or):
            operation = "and" if isinstance(e, sympy.And) else "or"
            first, *rest = (self._condition(argument) for argument in e.args)
            for other in rest:
                first = self._do(f"{operation} i1 {first}, {other}")
            return first
        if isinstance(e, sympy.Not):
            return self._do(f"xor i1 {self._condition(e.args[0])}, true")
        if isinstance(e, sympy.ITE):
            # A comparison of a choice, which SymPy turns into a choice of comparisons.
            asked, one, other = (self._condition(argument) for argument in e.args)
            return self._do(f"select i1 {asked}, i1 {one}, i1 {other}")
        if isinstance(e, sympy.logic.boolalg.BooleanAtom):
            return "true" if e == sympy.true else "false"
        return self._compared(_RELATIONS[type(e)], *(self.value(a) for a in e.args))

    def _compared(self, relation: str, one: str, other: str) -> str:
        return self._do(f"fcmp {relation} double {one}, {other}")

    def _selected(self, condition: str, one: str, other: str) -> str:
        return self._do(f"select i1 {condition}, double {one}, double {other}")

    def _function(self, e: sympy.Basic) -> str:
        name = type(e).__name__
        if name not in {*FUNCTIONS, "Abs", "sign", "floor"}:
            raise ModelError(f"found {e} in an expression, which cannot be computed")
        arguments = [self.value(argument) for argument in e.args]
        if name == "sign":
            zero, (x,) = literal(0.0), arguments
            # Zero and NaN remain as they are.
            below = self._selected(self._compared("olt", x, zero), literal(-1.0), x)
            return self._selected(self._compared("ogt", x, zero), literal(1.0), below)
        known = {"Abs": "llvm.fabs.f64", "floor": "llvm.floor.f64"}
        return self._call(known.get(name, name), *arguments)


def literal(value: float) -> str:
    """A number, exactly."""
    return f"0x{struct.unpack('<Q', struct.pack('<d', value))[0]:016X}"


@cache
def _target() -> tuple[Any, str, str]:
    llvm.initialize_native_target()
    llvm.initialize_native_asmprinter()
    features = llvm.get_host_cpu_features().flatten()
    return llvm.Target.from_default_triple(), llvm.get_host_cpu_name(), features


def _machine() -> Any:
    """Target machine for this processor; an engine takes ownership of the one it is given."""
    target, processor, features = _target()
    return target.create_target_machine(cpu=processor, features=features, opt=2, jit=True)


def machine_code(
    functions: Sequence[Function], further: str = ""
) -> tuple[Any, Callable[[str], int]]:
    """The object that keeps the code alive, and the address of each function by name.

    Args:
        functions: of the module.
        further: code of others, which may call them.
    """
    text = _DECLARED + "".join(function.text() for function in functions) + further
    module = llvm.parse_assembly(text)
    builder = llvm.create_pass_builder(
        _machine(), llvm.create_pipeline_tuning_options(speed_level=2)
    )
    builder.getModulePassManager().run(module, builder)
    engine = llvm.create_mcjit_compiler(module, _machine())
    engine.finalize_object()
    return engine, lambda name: int(engine.get_function_address(name))
