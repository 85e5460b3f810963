"""A file that no system can open ends every command with one plain line, never a traceback."""

import argparse
from types import ModuleType

import pytest

from rigwatch.commands import _actions, every_command, main

TOO_LONG = "x" * 300
QUESTION = {"rigwatch archive query": ["alarms"]}  # without one it lists what can be asked


def required(module: ModuleType) -> list[str]:
    """Impossible values for what a command cannot do without."""
    parser = argparse.ArgumentParser()
    module.add_arguments(parser)
    given: list[str] = []
    for action in parser._actions:
        if action.required and action.nargs != 0:
            value = str(next(iter(action.choices))) if action.choices else TOO_LONG
            given += [*action.option_strings[-1:], value]
    for group in parser._mutually_exclusive_groups:
        if group.required:
            given += [group._group_actions[0].option_strings[-1], TOO_LONG]
    return given


COMMANDS = {
    name: given
    for name, module in every_command()
    if not _actions(module) and TOO_LONG in (given := required(module))
}


def test_most_commands_need_a_file() -> None:
    assert len(COMMANDS) > 30


@pytest.mark.parametrize("name", COMMANDS)
def test_an_impossible_file_is_refused_in_one_line(
    name: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main([*name.split()[1:], *COMMANDS[name], *QUESTION.get(name, [])]) == 2
    said = capsys.readouterr()
    assert said.out == ""
    assert said.err.startswith("rigwatch: ")
    assert said.err.count("\n") == 1


def test_bytes_that_are_not_utf_8_are_refused_in_one_line(
    capsys: pytest.CaptureFixture[str],
) -> None:
    assert main(["info", "a\udcff.mcap"]) == 2
    assert "bytes that are not UTF-8" in capsys.readouterr().err
