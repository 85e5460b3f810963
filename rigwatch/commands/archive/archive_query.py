"""`rigwatch archive query`: a named question or SQL, answered from the index."""

import argparse
from datetime import UTC, datetime

from rigwatch.commands.archive.archive_text import table
from rigwatch.commands.common import POSITIVE, print_result, say, unix_time, whole

HELP = "query an archive: a named question, or one SELECT on sessions, alarms, losses, seconds"
EXAMPLE = """\
  rigwatch archive query sessions                            # lists the questions
  rigwatch archive query sessions friction-growth --until 2026-06-01
  rigwatch archive query sessions alarms --rig bench1 --since 2026-05-01
  rigwatch archive query sessions "select rig, sum(missing) from sessions group by rig" --json"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of the command."""
    parser.add_argument("url", metavar="URL", help="folder, or address such as s3://bucket/rigs")
    parser.add_argument("query", nargs="?", help="name of a question, or SQL")
    parser.add_argument("--rig", default="%", help="name of a rig, or a pattern with %%")
    parser.add_argument("--since", metavar="TIME", help="start of the span (ISO, UTC)")
    parser.add_argument("--until", metavar="TIME", help="end of the span (exclusive)")
    parser.add_argument(
        "--rows",
        type=whole(1),
        default=1000,
        metavar="N",
        help="maximum number of rows, default 1000",
    )
    parser.add_argument(
        "--seconds", type=POSITIVE, default=60.0, metavar="S", help="maximum time, default 60"
    )


def run(arguments: argparse.Namespace) -> int:
    """0 on success."""
    from rigwatch.archive import QUESTIONS, Bounds, Store, ask, query

    store = Store(arguments.url)
    store.check()
    if arguments.query is None:
        questions = {name: question.text for name, question in QUESTIONS.items()}
        print_result(arguments, questions, table(("question", "answers"), questions.items()))
        return 0
    bounds = Bounds(rows=arguments.rows, seconds=arguments.seconds)
    if " " in arguments.query.strip():
        answer = query(store, arguments.query, bounds=bounds)
    else:
        since, until = (_time(arguments, name) for name in ("since", "until"))
        answer = ask(
            store, arguments.query, rig=arguments.rig, since=since, until=until, bounds=bounds
        )
    data = {"columns": answer.columns, "rows": answer.as_dicts(), "more": answer.more}
    print_result(arguments, data, table(answer.columns, answer.rows))
    if answer.more and not arguments.json:
        say(f"only the first {bounds.rows} rows; --rows shows more")
    return 0


def _time(arguments: argparse.Namespace, name: str) -> datetime | None:
    text = getattr(arguments, name)
    if text is None:
        return None
    return datetime.fromtimestamp(unix_time(text, f"--{name}") / 1e9, UTC)
