"""TOML from strangers: refused in one plain line and in little time, whatever it asks for."""

import time

import pytest

from rigwatch.wire.errors import ConfigError
from rigwatch.wire.typed_files import Section, as_toml, loads, parse


class Small(Section):
    """A section with room for anything that a hostile file may put there."""

    a: float = 0.0
    text: str = ""


BOMBS = {
    "an integer of 5000 digits": f"a = {'9' * 5000}",
    "50 000 brackets": "a = " + "[" * 50_000,
    "closed brackets": "a = " + "[" * 20_000 + "]" * 20_000,
    "inline tables": "a = " + "{b = " * 5000 + "1" + "}" * 5000,
    "a dotted key": ".".join(["a"] * 50_000) + " = 1",
    "a dotted header": "[" + " . ".join(["a"] * 50_000) + "]",
    "a hexadecimal number": f"a = 0x{'f' * 100_000}",
    "much text": 'text = "' + "x" * (1 << 24) + '"',
    "many tables": "[[a]]\n" * 1_000_000,
    "quotes": '"' * 100_000,
    "backslashes": 'text = "' + "\\" * 100_001,
}


MOST_SECONDS = 5.0
"""Processor time, which does not depend on other work of the machine [s]."""


@pytest.mark.parametrize("text", BOMBS.values(), ids=BOMBS)
def test_a_bomb_is_refused_in_one_line_and_at_once(text: str) -> None:
    began = time.process_time()
    with pytest.raises(ConfigError) as refused:
        parse(text, Small, "sent.toml")
    assert time.process_time() - began < MOST_SECONDS
    assert "\n" not in str(refused.value)
    assert len(str(refused.value)) < 400


def test_what_stands_in_strings_and_comments_is_no_bomb() -> None:
    brackets, digits = "[" * 100, "9" * 500
    text = f'text = "{brackets} {digits} \\" a" # {brackets} {digits}\na = 1_000.5\n'
    assert parse(text, Small, "own.toml") == Small(a=1000.5, text=f'{brackets} {digits} " a')


def test_long_keys_of_digits_and_arrays_of_numbers_are_read() -> None:
    key = "7" * 200
    numbers = ", ".join(["-1.2345678901234567e-12"] * 2000)
    read = loads(f"{key} = 1\nb = [{numbers}]\nc.d.e = 'x'\n")
    assert read[key] == 1
    assert len(read["b"]) == 2000
    assert read["c"]["d"]["e"] == "x"


def test_keys_and_texts_of_any_letters_are_read_back() -> None:
    tree = {"größe": 'a "b" \\ c', "two words": {"ä": 1}, "plain_one-2": ["\u00e9\n"]}
    assert loads(as_toml(tree)) == tree
