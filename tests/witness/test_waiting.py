"""What waits for one recipient: which notice is sent next, and that none is lost."""

import pytest

from rigwatch.witness import waiting
from rigwatch.witness.notices import Notice
from rigwatch.witness.waiting import FEW, MOST_TOGETHER, Waiting
from tests.witness.test_people import fault


def notice(name: str, severity: str = "error") -> Notice:
    return Notice("ann", fault(name, severity=severity), 0, 0.0)


def filled(*notices: Notice, together: bool = True) -> Waiting:
    waits = Waiting(together=together)
    for one in notices:
        waits.put(one)
    return waits


def names(taken: tuple[Notice, ...]) -> list[str]:
    return [one.alarm.name for one in taken]


def test_few_go_one_by_one_the_worst_first() -> None:
    waits = filled(notice("a", "warning"), notice("b"), notice("c", "critical"))
    found = []
    for _ in range(FEW):
        found += [names(waits.take())]
        waits.sent()
    assert found == [["c"], ["b"], ["a"]]
    assert len(waits) == 0


def test_many_go_together_and_for_a_command_one_by_one() -> None:
    some = [notice(f"n{number}") for number in range(MOST_TOGETHER + 2)]
    waits = filled(*some)
    assert names(waits.take()) == [one.alarm.name for one in some[:MOST_TOGETHER]]
    assert len(waits) == len(some)
    waits.sent()
    assert len(waits) == 2
    assert names(filled(*some, together=False).take()) == ["n0"]


def test_a_later_notice_of_an_alarm_takes_the_place_of_the_earlier_one() -> None:
    waits = filled(notice("a"), notice("a", "critical"))
    assert waits.take()[0].alarm.severity == "critical"
    waits.put(notice("a", "warning"))
    waits.failed()
    assert waits.take()[0].alarm.severity == "warning"


def test_a_text_that_the_service_refuses_holds_back_no_other(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(waiting, "PAUSES_S", (0.0,))
    waits = filled(notice("refused", "critical"), *(notice(f"n{number}") for number in range(30)))
    got = list[str]()
    attempts = 0
    while len(waits) > 1:
        attempts += 1
        taken = names(waits.take())
        if "refused" in taken:
            assert waits.failed() == 0
        else:
            waits.sent()
            got += taken
    assert sorted(got) == sorted(f"n{number}" for number in range(30))
    assert attempts < 70
    assert names(waits.take()) == ["refused"]


def test_a_new_notice_does_not_wait_for_the_end_of_a_long_pause(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(waiting, "PAUSES_S", (0.0, 1e6))
    waits = filled(notice("a"))
    for _ in range(2):
        waits.take()
        waits.failed()
    waits.put(notice("b"))
    assert names(waits.take()) == ["b"]


def test_after_the_end_each_is_tried_once_more() -> None:
    waits = filled(notice("a"), notice("b"), notice("c"))
    waits.end()
    assert names(waits.take()) == ["a"]
    waits.sent()
    assert names(waits.take()) == ["b"]
    assert waits.failed() == 1
    assert names(waits.take()) == ["c"]
    waits.sent()
    assert waits.take() == ()


def test_what_is_seen_while_it_is_being_sent_does_not_come_back() -> None:
    waits = filled(notice("a"))
    waits.take()
    assert not waits.withdraw("a")
    assert waits.failed() == 1
    assert len(waits) == 0
