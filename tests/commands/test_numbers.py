"""Numbers of options that make no sense are refused in a sentence, by every command."""

import argparse

import pytest

from rigwatch.commands import every_command, main


def options() -> list[tuple[str, str]]:
    """Each option of each command that takes one number."""
    found = []
    for typed, module in every_command():
        if not hasattr(module, "add_arguments"):
            continue
        parser = argparse.ArgumentParser()
        module.add_arguments(parser)
        for action in parser._actions:
            kind = getattr(action.type, "__module__", "")
            is_number = action.type in (int, float) or kind.endswith("common.numbers")
            if is_number and action.nargs is None:
                found.append((typed.removeprefix("rigwatch "), action.option_strings[0]))
    return found


@pytest.mark.parametrize("text", ["nan", "inf", "-1", "1e999", "many"])
@pytest.mark.parametrize(("command", "option"), options())
def test_what_is_no_number_of_the_kind_is_refused(
    command: str, option: str, text: str, capsys: pytest.CaptureFixture[str]
) -> None:
    with pytest.raises(SystemExit) as ended:
        main([*command.split(), f"{option}={text}"])
    assert ended.value.code == 2
    last = capsys.readouterr().err.strip().splitlines()[-1]
    assert f"argument {option}: found '{text}', expected a" in last
