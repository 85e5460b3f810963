"""Renders pages from templates: each is one HTML file with inline style.

A report keeps its templates beside its code, in a folder `templates`. They extend `base.html` and
take tables, figures and numbers from `parts.html`, both of this package.
"""

from functools import cache
from importlib.resources import files

from jinja2 import ChoiceLoader, Environment, PackageLoader, StrictUndefined
from markupsafe import Markup

HERE = "rigwatch.page"
STYLE = files(HERE).joinpath("style.css").read_text(encoding="utf-8")


@cache
def templates(package: str = HERE) -> Environment:
    """The templates of a package and of this one; output is escaped except for `Markup`."""
    made = Environment(
        loader=ChoiceLoader([PackageLoader(package), PackageLoader(HERE)]),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    made.globals["style"] = Markup(STYLE)
    return made


def page(package: str, template: str, **values: object) -> str:
    """Render a whole page.

    Args:
        package: whose template it is, such as "rigwatch.structures.report".
        template: its name, such as "modes.html".
        values: values for the template.
    """
    return templates(package).get_template(template).render(values)
