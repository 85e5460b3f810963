"""Questions to an archive: right answers, and no way out of it."""

import json
from datetime import UTC, datetime, timedelta
from pathlib import Path

import pytest

from rigwatch.archive import QUESTIONS, Bounds, Store, ask, index, query
from rigwatch.archive.questions import COUNTS_BACK
from rigwatch.commands import main
from rigwatch.wire.errors import ArchiveError
from tests.archive.sessions import DAY_S, write_session

LOCKED = "disabled by configuration"


@pytest.fixture(scope="module")
def root(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Two rigs over two months: friction of the second grows."""
    folder = tmp_path_factory.mktemp("archive")
    for day, first, second in ((5, 1.0, 2.0), (20, 1.0, 2.0), (40, 1.0, 3.0), (59, 1.0, 5.0)):
        write_session(folder / f"one{day}.mcap", start_s=day * DAY_S, friction=first)
        write_session(
            folder / f"two{day}.mcap",
            rig="bench2",
            start_s=day * DAY_S,
            friction=second,
            missing=7 if day == 40 else 0,
            alarm="dry_friction" if second > 2 else "",
        )
    write_session(folder / "late.mcap", start_s=59 * DAY_S + 1, friction=1.0)
    index(Store(str(folder)))
    return folder


@pytest.fixture
def store(root: Path) -> Store:
    return Store(str(root))


def test_whose_friction_grew(store):
    found = ask(store, "friction-growth", until=datetime(2026, 3, 2, tzinfo=UTC)).as_dicts()
    assert [row["rig"] for row in found] == ["bench2", "bench1"]
    assert found[0]["growth"] == pytest.approx(2.0, abs=1e-3)
    assert found[1]["growth"] == pytest.approx(0.0, abs=1e-2)
    assert ask(store, "friction-growth").as_dicts() == found  # up to the end of the last session


def test_each_rig_counts_back_from_its_own_newest_session(tmp_path):
    for day, friction in ((5, 1.0), (40, 4.0)):
        write_session(tmp_path / f"one{day}.mcap", start_s=day * DAY_S, friction=friction)
    for day in (100, 300):  # long after the other was last recorded
        write_session(tmp_path / f"two{day}.mcap", rig="bench2", start_s=day * DAY_S, friction=2.0)
    store = Store(str(tmp_path))
    index(store)
    (row,) = ask(store, "friction-growth").as_dicts()
    assert row["rig"] == "bench1"
    assert row["growth"] == pytest.approx(3.0, abs=1e-2)
    assert ask(store, "friction-growth", rig="bench2").rows == []  # two months before: nothing
    assert ask(store, "friction-growth", rig="bench3").rows == []
    until = datetime(2026, 1, 1, tzinfo=UTC) + timedelta(days=301)
    assert ask(store, "friction-growth", until=until).rows == []  # of these 30 days


def test_a_question_that_counts_back_from_the_end_is_known_as_one():
    counting = {name for name, question in QUESTIONS.items() if "interval" in question.sql}
    assert counting == {name for name, question in QUESTIONS.items() if COUNTS_BACK in question.sql}


def test_alarms_of_a_rig_in_a_span(store):
    assert ask(store, "alarms", rig="bench1").rows == []
    since = datetime(2026, 1, 1, tzinfo=UTC) + timedelta(days=50)
    assert len(ask(store, "alarms").rows) == 2
    (row,) = ask(store, "alarms", rig="bench%", since=since).as_dicts()
    assert (row["rig"], row["name"], row["session"]) == ("bench2", "dry_friction", "two59.mcap")
    (count,) = ask(store, "alarm-counts").as_dicts()
    assert (count["raised"], count["rig"]) == (2, "bench2")


def test_where_samples_were_lost(store):
    (row,) = ask(store, "losses").as_dicts()
    assert (row["session"], row["missing"], row["gaps"]) == ("two40.mcap", 7, 1)
    (row,) = ask(store, "loss-times").as_dicts()
    assert (row["what"], row["count"], row["reason"]) == ("samples", 7, "line")


def test_clocks_that_overlap(store):
    (row,) = ask(store, "overlaps").as_dicts()
    assert {row["session"], row["other"]} == {"late.mcap", "one59.mcap"}
    assert row["seconds"] == pytest.approx(3, abs=0.1)


def test_the_questions_are_listed_for_an_archive_that_is_there(root, tmp_path, capsys):
    assert main(["archive", "query", str(root)]) == 0
    assert "friction-growth" in capsys.readouterr().out
    assert main(["archive", "query", str(tmp_path / "nowhere")]) == 2
    assert "no such folder" in capsys.readouterr().err


@pytest.mark.parametrize("name", QUESTIONS)
def test_every_question_has_an_answer_on_the_command_line(root, name, capsys):
    assert main(["archive", "query", str(root), name, "--json"]) == 0
    whole = json.loads(capsys.readouterr().out)
    assert whole["columns"]
    assert main(["archive", "query", str(root), name]) == 0
    assert capsys.readouterr().out.splitlines()[0].split() == whole["columns"]


@pytest.mark.parametrize(
    ("sql", "said"),
    [
        ("select * from read_text('/etc/passwd')", LOCKED),
        ("select * from read_text('{root}/one5.mcap')", LOCKED),
        (
            "select * from read_text('{root}/rigwatch-index/../one5.mcap')",
            "disabled by configuration",
        ),
        ("copy (select 1) to '{root}/rigwatch-index/x.csv'", "found COPY, expected one SELECT"),
        ("create table t as select 1", "found CREATE, expected one SELECT"),
        ("install httpfs", "expected one SELECT"),
        ("set memory_limit='9GB'", "expected one SELECT"),
        ("attach 'x.db'", "found ATTACH, expected one SELECT"),
        ("select 1; select 2", "found SELECT, SELECT, expected one SELECT"),
        ("select * from store", "does not exist"),
        ("selekt nothing at all", "syntax error"),
    ],
)
def test_a_query_reads_the_index_and_nothing_else(store, root, sql, said):
    with pytest.raises(ArchiveError, match=said) as refused:
        query(store, sql.format(root=root))
    assert "\n" not in str(refused.value)


def test_rows_time_and_memory_are_bounded(store):
    found = query(store, "select * from range(100)", bounds=Bounds(rows=10))
    assert (len(found.rows), found.more) == (10, True)
    endless = "select count(*) from range(1000000) a, range(1000000) b where a.range < b.range"
    with pytest.raises(ArchiveError, match=r"took more than 0\.2 s"):
        query(store, endless, bounds=Bounds(seconds=0.2))
    large = "select list(range) from range(100000000)"
    with pytest.raises(ArchiveError, match="Out of Memory"):
        query(store, large, bounds=Bounds(memory_mb=50))


def test_commands_index_and_show(root, capsys):
    assert main(["archive", "index", str(root)]) == 0
    assert "9 sessions (9 ok); 0 read, 0 removed" in capsys.readouterr().out
    assert main(["archive", "show", str(root)]) == 0
    assert "bench2" in capsys.readouterr().out
    assert main(["archive", "show", str(root), "two40.mcap"]) == 0
    out = capsys.readouterr().out
    assert "missing: 7" in out
    assert "dry_friction" in out
    assert main(["archive", "show", str(root), "two4.mcap"]) == 2
    assert "did you mean 'two40.mcap'" in capsys.readouterr().err
    assert main(["archive", "query", str(root), "frictiongrowth"]) == 2
    assert "did you mean 'friction-growth'" in capsys.readouterr().err
