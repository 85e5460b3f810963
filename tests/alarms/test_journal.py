"""What the journal keeps: everything that was written, after kill -9, torn lines and full disks."""

import errno
import json
import os
import re
import shutil
import signal
import subprocess
import sys
import textwrap
from pathlib import Path

import pytest

from monitor.alarms import AlarmJournal, AlarmManager, read_journal
from monitor.alarms.journal import MOST_WAITING
from rigwatch.wire.errors import SessionError
from rigwatch.wire.messages import Alarm, decode, encode
from tests.alarms.alarm_signals import condition, newest, order, run, spell

ROOT = Path(__file__).parents[2]


def faulty_manager() -> AlarmManager:
    """Friction named and acknowledged, a sensor stuck and not seen, one alarm shelved."""
    alarms = AlarmManager()
    run(
        alarms,
        [
            condition("departure", spell(1500, (100, 1500))),
            condition("dry_friction", spell(1500, (400, 1500))),
            condition("sensor_stuck.position", spell(1500, (600, 700))),
            condition("gap", spell(1500, (800, 801))),
        ],
    )
    alarms.command(order("dry_friction", "acknowledge", text="looking"))
    alarms.command(order("gap", "shelve"))
    return alarms


def states(manager: AlarmManager) -> dict[str, str]:
    return {alarm.name: alarm.state for alarm in manager.standing()}


def restarted(path: Path) -> AlarmManager:
    alarms = AlarmManager()
    alarms.restore(newest(read_journal(path)[0]))
    return alarms


def test_a_restarted_manager_stands_where_the_old_one_stood(tmp_path):
    old = faulty_manager()
    path = tmp_path / "deep" / "alarms.jsonl"
    journal = AlarmJournal(path)
    journal.write(old.take_changes())
    journal.close()
    new = restarted(path)
    assert {(a.name, a.state, a.onset_seq, a.first_out) for a in new.standing()} == {
        ("dry_friction", "acknowledged", 100, True),
        ("sensor_stuck.position", "cleared_unacknowledged", 600, False),
    }
    assert new.command(order("gap", "unshelve"))[0].code == "alarm_unshelved"


def test_after_the_restart_a_fault_that_has_gone_clears_and_can_be_reset(tmp_path):
    path = tmp_path / "alarms.jsonl"
    AlarmJournal(path).write(faulty_manager().take_changes())
    new = restarted(path)
    quiet = [condition(name, [0] * 600) for name in ("departure", "dry_friction")]
    assert run(new, quiet) == []
    assert new.command(order("dry_friction", "reset"))[0].state == "normal"


def test_after_the_restart_a_fault_that_lasts_is_not_announced_as_new(tmp_path):
    path = tmp_path / "alarms.jsonl"
    AlarmJournal(path).write(faulty_manager().take_changes())
    lasting = [condition(name, [1] * 600) for name in ("departure", "dry_friction")]
    assert run(restarted(path), lasting) == []


def test_records_come_back_equal_and_are_strict_json(tmp_path):
    path = tmp_path / "alarms.jsonl"
    changes = faulty_manager().take_changes()
    AlarmJournal(path).write(changes)
    records, unreadable = read_journal(path)
    assert (repr(records), unreadable) == (repr(changes), 0)
    for line in path.read_text().splitlines():
        json.loads(line, parse_constant=lambda word: pytest.fail(f"{word} is no JSON"))


@pytest.mark.parametrize("torn", [1, 5, 40, 200])
def test_a_torn_last_line_costs_that_line_only(tmp_path, torn):
    path = tmp_path / "alarms.jsonl"
    changes = faulty_manager().take_changes()
    journal = AlarmJournal(path)
    journal.write(changes)
    journal.close()
    os.truncate(path, path.stat().st_size - torn)
    kept, unreadable = read_journal(path)
    whole = torn == 1
    assert len(kept) == len(changes) - (not whole)
    assert unreadable == (not whole)
    again = AlarmJournal(path)
    again.write(changes[:1])
    assert read_journal(path)[0] == [*kept, changes[0]] or repr(read_journal(path)[0]) == repr(
        [*kept, changes[0]]
    )


def test_garbage_lines_are_counted_and_skipped(tmp_path):
    path = tmp_path / "alarms.jsonl"
    changes = faulty_manager().take_changes()
    garbage = [b"\xff\xfe\x00", b"[]", b'{"alarm": 3}', b"null", b'{"alarm": {"name": "x"}}']
    path.write_bytes(b"\n".join(garbage) + b"\n")
    AlarmJournal(path).write(changes)
    records, unreadable = read_journal(path)
    assert (repr(records), unreadable) == (repr(changes), len(garbage))


@pytest.mark.parametrize(
    ("written", "damaged"),
    [
        (b'"t_ns": 1', b'"t_ns": 9'),  # one bit of a time of nineteen digits
        (b'"seq": ', b'"seq": -99999999999999999999'),
        (b'"unacknowledged"', b'"unacknowlddged"'),
        (b'"severity": "error"', b'"severity": "errnr"'),
    ],
)
def test_a_record_that_cannot_be_told_counts_as_unreadable(tmp_path, written, damaged):
    path = tmp_path / "alarms.jsonl"
    journal = AlarmJournal(path)
    journal.write(faulty_manager().take_changes())
    journal.close()
    text = re.sub(rb'"t_ns": \d+', b'"t_ns": 1767225600000000000', path.read_bytes())
    assert written in text
    path.write_bytes(text.replace(written, damaged))
    records, unread = read_journal(path)
    assert unread > 0
    for record in records:
        assert decode(Alarm, encode(record.alarm)) is not None
    for alarm in restarted(path).standing():
        assert encode(alarm)


def test_no_journal_yet_is_no_error(tmp_path):
    assert read_journal(tmp_path / "none.jsonl") == ([], 0)


def test_a_journal_that_cannot_be_opened_is_one_plain_line(tmp_path):
    with pytest.raises(SessionError, match="alarm journal cannot be opened"):
        AlarmJournal(tmp_path)


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="needs /dev/full")
def test_a_full_disk_is_remembered_not_raised():
    journal = AlarmJournal("/dev/full")
    journal.write(faulty_manager().take_changes())
    assert "no space left" in journal.failure


def test_kill_9_loses_nothing_that_was_written(tmp_path):
    """A process writes a record and then says so; killed, all that it said is in the file."""
    path = tmp_path / "alarms.jsonl"
    program = textwrap.dedent(
        f"""
        from dataclasses import replace
        from tests.alarms.test_journal import faulty_manager
        from monitor.alarms import AlarmJournal
        journal = AlarmJournal({str(path)!r})
        record = faulty_manager().take_changes()[0]
        for number in range(1_000_000):
            journal.write([replace(record, alarm=replace(record.alarm, seq=number))])
            print(number, flush=True)
        """
    )
    process = subprocess.Popen(
        [sys.executable, "-c", program], stdout=subprocess.PIPE, text=True, cwd=ROOT
    )
    assert process.stdout is not None
    for _ in range(50):
        process.stdout.readline()
    process.send_signal(signal.SIGKILL)
    said = process.stdout.read().split()
    process.wait()
    records, unreadable = read_journal(path)
    assert unreadable <= 1
    assert [record.alarm.seq for record in records] == list(range(len(records)))
    assert len(records) > int(said[-1] if said else 49)


def test_a_torn_line_on_a_full_disk_does_not_keep_the_monitor_from_starting(tmp_path, monkeypatch):
    path = tmp_path / "alarms.jsonl"
    AlarmJournal(path).write(faulty_manager().take_changes())
    before = read_journal(path)[0]
    with path.open("ab") as file:
        file.write(b'{"alarm": {"na')
    write, full = os.write, True

    def on_a_full_disk(file: int, data: bytes) -> int:
        if full:
            raise OSError(errno.ENOSPC, "No space left on device")
        return write(file, data)

    monkeypatch.setattr(os, "write", on_a_full_disk)
    journal = AlarmJournal(path)
    journal.write(before[:1])
    assert "no space left" in journal.failure
    full = False
    journal.write(before[1:2])
    assert journal.failure == ""
    assert read_journal(path) == ([*before, *before[:2]], 1)


def test_what_waits_for_a_full_disk_for_days_is_bounded_and_the_state_of_every_alarm_is_kept(
    tmp_path, monkeypatch
):
    path, write, room, full = tmp_path / "alarms.jsonl", os.write, [7], True
    changes = faulty_manager().take_changes()
    journal = AlarmJournal(path)
    journal.write(changes[:1])

    def on_a_full_disk(file: int, data: bytes) -> int:
        if full and not room:
            raise OSError(errno.ENOSPC, "No space left on device")
        return write(file, data[: room.pop()] if full else data)

    monkeypatch.setattr(os, "write", on_a_full_disk)
    written = 0
    while written < 3 * MOST_WAITING:
        journal.write(changes)
        written += len(changes)
        assert len(journal._waiting) <= MOST_WAITING
    left_out = int(re.search(r"(\d+) records are left out", journal.failure)[1])
    assert written - left_out == sum(line != b"\n" for line in journal._waiting)
    full = False
    journal.write([])
    assert journal.failure == ""
    expected = AlarmManager()
    expected.restore(newest(changes))
    assert restarted(path).standing() == expected.standing() != []


def test_many_records_at_once_are_all_written_while_the_disk_takes_them(tmp_path):
    path, changes = tmp_path / "alarms.jsonl", faulty_manager().take_changes()
    many = changes * (2 + MOST_WAITING // len(changes))
    journal = AlarmJournal(path)
    journal.write(many)
    assert journal.failure == ""
    assert len(read_journal(path)[0]) == len(many) > MOST_WAITING


def test_an_endless_line_is_one_bad_line(tmp_path):
    path = tmp_path / "alarms.jsonl"
    AlarmJournal(path).write(faulty_manager().take_changes())
    good = path.read_bytes()
    path.write_bytes(b"[" * 1_000_000 + b"\n" + good)
    records, bad = read_journal(path)
    assert len(records) == good.count(b"\n")
    assert bad == 1


def test_a_journal_that_has_grown_is_rotated_and_keeps_the_state_of_every_alarm(tmp_path):
    old = faulty_manager()
    changes = old.take_changes()
    path = tmp_path / "alarms.jsonl"
    journal = AlarmJournal(path, largest=20_000)
    for _ in range(200):
        journal.write(changes)
        assert path.stat().st_size < 20_000 + 10_000
    journal.close()
    assert journal.failure == ""
    assert sorted(p.name for p in tmp_path.iterdir()) == ["alarms.jsonl"] + [
        f"alarms.jsonl.{number}" for number in range(1, 9)
    ]
    expected = AlarmManager()
    expected.restore(newest(changes))
    assert restarted(path).standing() == expected.standing() != []
    reopened = AlarmJournal(path)
    assert {one.alarm.name for one in reopened.newest()} == {one.alarm.name for one in changes}
    reopened.close()


def test_a_journal_is_rotated_where_the_file_system_has_no_links(tmp_path, monkeypatch):
    def refused(*_: object, **__: object) -> None:
        raise PermissionError(errno.EPERM, os.strerror(errno.EPERM))

    monkeypatch.setattr(os, "link", refused)  # as on a memory card
    test_a_journal_that_has_grown_is_rotated_and_keeps_the_state_of_every_alarm(tmp_path)


def test_no_older_journal_is_lost_while_rotating_fails(tmp_path, monkeypatch):
    path = tmp_path / "alarms.jsonl"
    journal = AlarmJournal(path, largest=20_000)
    changes = faulty_manager().take_changes()
    while not (tmp_path / "alarms.jsonl.8").exists():
        journal.write(changes)
    older = {file.name: file.read_bytes() for file in tmp_path.glob("alarms.jsonl.?")}

    def full(*_: object, **__: object) -> None:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    with monkeypatch.context() as patched:
        patched.setattr(os, "link", full)
        patched.setattr(shutil, "copyfile", full)
        for _ in range(20):
            journal.write(changes)
        assert "no space left on the disk" in journal.failure
    kept = {file.name: file.read_bytes() for file in tmp_path.glob("alarms.jsonl.?")}
    assert kept == older
    journal.write(changes)
    assert journal.failure == ""
    journal.close()


@pytest.mark.parametrize("replaced", [False, True])
def test_a_journal_that_somebody_removes_is_written_anew_with_the_state_of_every_alarm(
    tmp_path, replaced
):
    path = tmp_path / "of the rig" / "alarms.jsonl"
    old = faulty_manager()
    journal = AlarmJournal(path)
    journal.write(old.take_changes())
    shutil.rmtree(path.parent)
    if replaced:
        path.parent.mkdir()
        path.write_text("of a backup\n")
    old.command(order("sensor_stuck.position", "acknowledge"))
    changes = old.take_changes()
    journal.write(changes)
    assert journal.failure == ""
    assert states(restarted(path)) == states(old) != {}
    journal.write(changes)
    assert read_journal(path)[0][-len(changes) :] == changes
    journal.close()
    set_aside = path.with_name("alarms.jsonl.set-aside")
    assert (set_aside.is_file() and set_aside.read_text() == "of a backup\n") == replaced


def test_a_journal_without_identities_is_read(tmp_path):
    """Of a version before commands were signed."""
    path = tmp_path / "alarms.jsonl"
    journal = AlarmJournal(path)
    alarms = faulty_manager()
    journal.write(alarms.take_changes())
    lines = [json.loads(line) for line in path.read_text().splitlines()]
    assert {line["alarm"]["identity"] for line in lines} == {"", "not proved"}
    for line in lines:
        del line["alarm"]["identity"]
    path.write_text("".join(json.dumps(line) + "\n" for line in lines))
    records, unread = read_journal(path)
    assert unread == 0
    assert {record.alarm.identity for record in records} == {""}
    found, expected = restarted(path).standing(), alarms.standing()
    assert [(one.name, one.state) for one in found] == [(one.name, one.state) for one in expected]
