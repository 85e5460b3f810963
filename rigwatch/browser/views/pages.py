"""Renders a template of this room."""

from functools import cache
from typing import Protocol

from jinja2 import Environment

from rigwatch.page import templates

HERE = "rigwatch.browser.views"


class _Teller(Protocol):
    """What tells errors in a unit of its own: a comparison, or one of its channels."""

    def told(self, error: float) -> float: ...


def _told(error: float | None, where: _Teller | None) -> float | None:
    """An error in the unit in which it is told; as it is if nothing tells a unit."""
    return error if error is None or where is None else where.told(error)


@cache
def _environment() -> Environment:
    made = templates(HERE)
    made.filters["plain"] = lambda text: str(text).replace("_", " ")
    made.filters["told"] = _told
    made.filters["sig"] = lambda value: "–" if value is None else f"{value:.4g}"
    return made


def render(template: str, **values: object) -> str:
    """A page or a part of one."""
    return _environment().get_template(template).render(values)
