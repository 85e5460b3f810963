"""Expressions that ask for too much are refused in one line and at once."""

import time

import pytest
import sympy

from rigwatch.physics.engine.equations.expression import parse
from rigwatch.physics.engine.equations.expression_dimension import dimension_of
from rigwatch.wire.errors import ModelError

X = {"x": sympy.Symbol("x", real=True)}
BOMBS = {
    "50 000 minuses": "-" * 50_000 + "x",
    "1000 minuses": "-" * 1000 + "x",
    "a tower of powers": "9**9**9**9",
    "a large power": "x*9**100000000",
    "a power of a power": "(9**60)**60**60",
    "a negative tower": "9**(-9**9**9)",
    "a root of a tower": "2**(1e300)",
    "powers within powers": "((((9**60)**60)**60)**60)**60*x",
    "functions within functions": "tanh(x+" * 60 + "x" + ")" * 60,
    "no value": "x/0",
    "infinity": "x*1e999",
    "a comparison with infinity": "x*1e999*0 > 1",
    "arithmetic with a comparison": "tanh(x/0 > 1) + x",
    "an integer of 5000 digits": "9" * 5000,
    "many terms": "+".join(["x"] * 9000),
}


MOST_SECONDS = 5.0
"""Processor time, which does not depend on other work of the machine [s]."""


@pytest.mark.parametrize("text", BOMBS.values(), ids=BOMBS)
def test_a_bomb_is_refused_at_once(text: str) -> None:
    began = time.process_time()
    with pytest.raises(ModelError) as refused:
        parse(text, X, "force of effect boom")
    assert time.process_time() - began < MOST_SECONDS
    assert len(str(refused.value)) < 500


def test_dimensions_are_bounded_in_the_same_way() -> None:
    with pytest.raises(ModelError):
        dimension_of("-" * 50_000 + "x", {}, "boom")


@pytest.mark.parametrize("text", ["x*sqrt(-1 - x**2/x**2)", "x + (-2)**0.5", "log(-1)*x"])
def test_an_expression_without_a_real_value_is_refused(text: str) -> None:
    with pytest.raises(ModelError, match="which has no real value"):
        parse(text, X, "force of effect imaginary")


def test_usual_powers_and_sums_stay() -> None:
    assert parse("x**3 + 2**10*x - 1e-3*x**0.5", X, "good").has(X["x"])
    assert parse(" + ".join(f"{k}*x" for k in range(1, 300)), X, "good").has(X["x"])
    assert parse("tanh(x+" * 20 + "x" + ")" * 20, X, "good").diff(X["x"]).has(X["x"])
    assert parse(" + ".join(f"{k}*x**{k % 5}" for k in range(1, 150)), X, "good").has(X["x"])


def test_pythons_remarks_on_style_reach_nobody(recwarn: pytest.WarningsRecorder) -> None:
    with pytest.raises(ModelError):
        parse("2and x", X, "sent")
    assert not recwarn.list
