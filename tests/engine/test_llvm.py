"""Machine code of expressions: the numbers that NumPy gives, whatever the expression."""

import ctypes

import numpy as np
import pytest
import sympy

from rigwatch.physics.engine.compile.derivatives import derivative
from rigwatch.physics.engine.compile.llvm import Function, machine_code
from rigwatch.physics.engine.compile.static_kernel import numpy_function
from rigwatch.physics.engine.equations.expression import parse
from rigwatch.physics.engine.equations.scope import symbol
from rigwatch.wire.errors import ModelError

NAMES = ("x", "v", "k")
SYMBOLS = {name: symbol(name) for name in (*NAMES, "t")}
VALUES = [-3.0, -1.0, -0.25, 0.0, 1e-9, 0.5, 2.0, 7.5]
POINTS = np.stack(np.meshgrid(VALUES, VALUES, VALUES), axis=-1).reshape(-1, 3)
TEXTS = [
    "x + v - 2*k", "x*v/k", "k/(x*v)", "x**2", "x**3 - v**4", "x**(-3)", "x**17", "x**2.5",
    "1/sqrt(x)", "x/sqrt(v)**3", "sqrt(abs(v))*x", "x**k", "sin(x) + cos(v) + atan(k)",
    "tanh(x/0.01)",
    "exp(-(v/0.5)**2)", "log(x)", "floor(x*3.3)", "sign(x)*abs(v)", "max(x, min(v, k))",
    "where(x > v, x, v/k)", "where(x <= 0, where(v >= k, 1.5, x), v)",
    "where(where(x > v, x, -k)*v > 0, x, k)", "where(where(x > 0, 1, 0) > 0.5, v, k)",
    "x*t + 0.1", "3",
]  # fmt: skip


def machine(expression, time=0.7):
    """The expression as a function of an array of points, called one by one."""
    places = {symbol(name): ("a", index) for index, name in enumerate(NAMES)}
    function = Function("f", {**places, symbol("t"): None}, {})
    function.store("out", 0, function.value(expression))
    kept, address = machine_code([function])
    call = ctypes.CFUNCTYPE(None, ctypes.c_double, *[ctypes.c_void_p] * 5)(address("f"))
    out = np.empty(1)

    def evaluated(points):
        found = []
        for point in np.ascontiguousarray(points):
            call(time, point.ctypes.data, 0, 0, out.ctypes.data, 0)
            found.append(out[0])
        assert kept
        return np.array(found)

    return evaluated


@pytest.mark.parametrize("text", TEXTS)
def test_machine_code_gives_the_numbers_that_numpy_gives(text):
    expression = parse(text, SYMBOLS, "test")
    expected = numpy_function([*NAMES, "t"], expression)(*POINTS.T, 0.7)
    expected = np.broadcast_to(np.asarray(expected, float), len(POINTS))
    np.testing.assert_allclose(machine(expression)(POINTS), expected, rtol=1e-12, atol=1e-15)


def test_conditions_can_be_joined_and_turned_round():
    x, v, k = (symbol(name) for name in NAMES)
    condition = sympy.Or(sympy.And(x > 0, v < 1), sympy.Not(k >= 2))
    expression = sympy.Piecewise((x - v, condition), (k, True))
    a, b, c = POINTS.T
    expected = np.where(((a > 0) & (b < 1)) | ~(c >= 2), a - b, c)
    np.testing.assert_array_equal(machine(expression)(POINTS), expected)


LIMITED = "max(min(where(x > v, x, -x) + where(v > k, v, -v), k), -k)"


@pytest.mark.parametrize("name", ["x", "v", "k"])
def test_the_slope_of_a_limit_is_a_step_and_makes_no_further_choices(name):
    limited = parse(LIMITED, SYMBOLS, "test")
    slope = derivative(limited, symbol(name))
    # SymPy folds a choice whose condition has choices, which takes it minutes where these are many.
    assert slope.atoms(sympy.Piecewise) <= limited.atoms(sympy.Piecewise) | choices_of_slopes(name)
    at = np.array([[1.3, 0.4, 2.2], [0.2, 0.9, 0.8], [-2.0, 3.0, 1.5], [0.3, -0.2, 0.1]])
    step = 1e-6 * np.eye(3)[NAMES.index(name)]
    value = machine(limited)
    expected = (value(at + step) - value(at - step)) / 2e-6
    np.testing.assert_allclose(machine(slope)(at), expected, atol=1e-8)
    arrays = numpy_function([*NAMES, "t"], slope)(*at.T, 0.7)
    np.testing.assert_allclose(arrays, expected, atol=1e-8)


def choices_of_slopes(name):
    """The slopes of the choices that a limit limits."""
    inner = parse("where(x > v, x, -x) + where(v > k, v, -v)", SYMBOLS, "test")
    return derivative(inner, symbol(name)).atoms(sympy.Piecewise)


def test_numbers_that_are_none_stay_none():
    found = machine(parse("x + tanh(v)", SYMBOLS, "test"))(
        np.array([[np.nan, 1, 0], [1, np.inf, 0]])
    )
    assert np.isnan(found[0])
    assert found[1] == 2.0


def test_a_function_without_machine_code_is_named():
    with pytest.raises(ModelError, match="gamma"):
        machine(sympy.gamma(symbol("x")))
