"""The report of a study: one self-contained HTML page without network access.

write_report(open_study("emps"), Path("emps.html"))

Charts are inline SVG in the page's colours and follow the system's light or dark theme. Numbers are
stored in full precision and in SI in `<data value="…">`, so a program reads the same values as from
`rigwatch compare --json`; errors are shown in the unit in which the verdict tells them.
"""

from collections.abc import Callable
from pathlib import Path

from rigwatch.page import page
from rigwatch.wire.errors import ModelError
from rigwatch.wire.new_file import write_new
from rigwatch.workbench.compare import locate
from rigwatch.workbench.explain import explained
from rigwatch.workbench.report import charts, sections
from rigwatch.workbench.steps import signals, stages
from rigwatch.workbench.study import Study
from rigwatch.workbench.study import ledger as book


def gather(study: Study, progress: Callable[[str], None] = lambda _: None) -> sections.Material:
    """Collect everything that the report shows.

    Raises:
        ModelError: data have changed, or do not suit the model.
    """
    progress("fitting every step")
    found = stages(study)
    progress("simulating")
    shown = [signals(stage) for stage in found]
    progress("ranking effects")
    last = found[-1].bench
    told = explained(last, progress).explanation
    before, now = locate(found[0].bench), locate(last)
    return sections.Material(study, found, shown, told, before, now, list(book.lines(study)))


def report_html(m: sections.Material) -> str:
    """The page."""
    name = m.study.folder.resolve().name
    return page(
        "rigwatch.workbench.report", "study.html", m=m, name=name, sections=sections, charts=charts
    )


def write_report(
    study: Study, path: Path, progress: Callable[[str], None] = lambda _: None
) -> sections.Material:
    """Write the report of a study; return its content.

    Raises:
        ModelError: data have changed or do not suit the model, or the file cannot be written.
    """
    material = gather(study, progress)
    write_new(path, report_html(material), replace=True, raises=ModelError)
    return material
