"""Renders a template of this room."""

from functools import cache

from jinja2 import Environment

from rigwatch.page import templates

HERE = "rigwatch.browser.views"


@cache
def _environment() -> Environment:
    made = templates(HERE)
    made.filters["plain"] = lambda text: str(text).replace("_", " ")
    made.filters["sig"] = lambda value: "–" if value is None else f"{value:.4g}"
    return made


def render(template: str, **values: object) -> str:
    """A page or a part of one."""
    return _environment().get_template(template).render(values)
