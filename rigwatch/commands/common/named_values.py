"""Options of the form NAME=VALUE."""

from collections.abc import Sequence


def named_values(option: str, given: Sequence[str], example: str) -> dict[str, float]:
    """The numbers of an option that may be repeated, by name.

    Args:
        option: its name, for errors.
        given: texts of the form NAME=VALUE.
        example: one, for errors.

    Raises:
        ModelError: a text has another form.
    """
    from rigwatch.wire.errors import ModelError

    found = {}
    for text in given:
        name, _, value = (part.strip() for part in text.partition("="))
        try:
            found[name] = float(value)
        except ValueError:
            expected = f"expected NAME=VALUE such as {example}"
            raise ModelError(f"{option}: found {text!r}, {expected}") from None
    return found
