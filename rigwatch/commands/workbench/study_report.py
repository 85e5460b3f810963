"""What `rigwatch study report` does."""

import argparse

from rigwatch.commands.common import print_json, say


def report(arguments: argparse.Namespace) -> int:
    """Write the page; 0."""
    from rigwatch.workbench.report import write_report
    from rigwatch.workbench.study import open_study

    study = open_study(arguments.study)
    path = arguments.output or study.folder / "report.html"
    found = write_report(study, path, progress=say)
    last = found.stages[-1].comparison
    if arguments.json:
        print_json({"file": path, "verdict": found.explanation.verdict, "comparison": last})
        return 0
    error = f"{last.held_out_error:.4g} {last.unit}"
    print(f"{path}: {len(found.stages)} steps, held-out error {error}")
    return 0
