"""A process is not gone while its link is made again, and is gone within a second of its end."""

import pytest

from monitor.process.presence import Presence


def present(*tokens: tuple[float, bool], heard: tuple[float, ...] = ()) -> Presence:
    made = Presence()
    for now, alive in tokens:
        made.token(now, alive=alive)
    for now in heard:
        made.heard(now)
    return made


def test_one_that_never_appeared_is_not_there() -> None:
    assert not present().holds(0.0)


@pytest.mark.parametrize("away", [0.05, 0.2, 0.5])
def test_a_token_that_comes_back_was_never_missed(away: float) -> None:
    one = present((0.0, True), (10.0, False))
    assert one.holds(10.0 + away)
    one.token(10.0 + away, alive=True)
    assert one.holds(100.0)


def test_one_that_dies_is_gone_within_a_second() -> None:
    one = present((0.0, True), (10.0, False))
    assert not one.holds(10.9)


def test_a_word_from_before_the_end_that_is_read_later_does_not_revive_it() -> None:
    one = present((0.0, True), (10.0, False), heard=(10.3,))
    assert one.holds(10.9)
    assert not one.holds(11.2)


def test_one_that_speaks_is_there_without_a_token() -> None:
    one = present((0.0, True), (10.0, False), heard=(10.5, 11.0, 11.5))
    assert one.holds(12.0)
    assert not one.holds(13.0)
