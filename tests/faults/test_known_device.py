"""The first device that tells who it is stays the rig's, until a person accepts another one."""

from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from daq.adapters.identification import Identification, NoIdentificationError
from daq.adapters.modbus_poll import RefusedError
from daq.known_device import SET_ASIDE, DamagedError, KnownDevice, Met, read_devices
from rigwatch.wire.errors import ModbusError

FIRST, OTHER = "RX-2, no. 4711", "RX-2, no. 4712"


@pytest.fixture
def path(tmp_path: Path) -> Path:
    return tmp_path / "state" / "alarms.jsonl.device"


def known_at(path: Path | None) -> KnownDevice:
    return KnownDevice("daq/rig", path, now_ns=lambda: 5)


def codes(known: KnownDevice) -> list[str]:
    return [event.code for event in known.events()]


def test_the_first_device_is_learnt_and_another_one_refused_over_a_restart(path: Path) -> None:
    known = known_at(path)
    assert known.admits(FIRST)
    assert codes(known) == ["device_learnt"]
    assert not known.admits(OTHER)
    after = known_at(path)
    assert (after.expected, after.admits(OTHER), after.refused) == (FIRST, False, OTHER)
    assert (after.admits(FIRST), after.refused) == (True, None)
    assert not after.admits("")
    assert codes(after) == []


def test_what_a_person_accepts_is_kept_with_who_and_why(path: Path) -> None:
    known = known_at(path)
    known.admits(FIRST)
    known.admits(OTHER)
    assert known.accept(OTHER, "ann", "exchanged", "proved") == ""
    (learnt, accepted) = known.events()
    assert learnt.code == "device_learnt"
    assert accepted.code == "device_accepted"
    for part in (repr(FIRST), repr(OTHER), "ann (proved)", "exchanged"):
        assert part in accepted.text
    assert read_devices(path) == (Met(FIRST, 5), Met(OTHER, 5, "ann", "exchanged", "proved"))
    after = known_at(path)
    assert [after.admits(one) for one in (OTHER, FIRST)] == [True, False]


def test_only_the_device_that_is_refused_now_can_be_accepted(path: Path) -> None:
    known = known_at(path)
    known.admits(FIRST)
    assert "no device is refused" in known.accept(OTHER, "ann", "", "proved")
    known.admits(OTHER)
    assert "another device answers by now" in known.accept("RX-3", "ann", "", "proved")
    known.admits(FIRST)
    assert "no device is refused" in known.accept(OTHER, "ann", "", "proved")
    assert read_devices(path) == (Met(FIRST, 5),)


def test_a_device_that_tells_nothing_is_taken_and_one_that_tells_something_then_learnt(
    path: Path,
) -> None:
    known = known_at(path)
    assert known.admits("")
    assert codes(known) == []
    assert read_devices(path) == (Met("", 5),)
    after = known_at(path)
    assert [after.admits(one) for one in ("", FIRST, "", OTHER)] == [True, True, False, False]
    assert after.accept(OTHER, "ann", "", "not proved") == ""
    assert [after.admits(one) for one in (OTHER, "")] == [True, False]
    assert after.accept("", "bob", "", "not proved") == ""
    assert known_at(path).admits("")


def test_a_file_with_any_bit_changed_is_noticed_set_aside_and_the_device_learnt_anew(
    path: Path,
) -> None:
    known_at(path).admits(FIRST)
    sound = path.read_bytes()
    for place in range(len(sound)):
        spoilt = bytearray(sound)
        spoilt[place] ^= 1
        path.write_bytes(spoilt)
        with pytest.raises(DamagedError):
            read_devices(path)
    path.write_bytes(sound[:-7])
    known = known_at(path)
    assert codes(known) == ["device_forgotten"]
    assert path.with_name(path.name + SET_ASIDE).read_bytes() == sound[:-7]
    assert known.admits(OTHER)
    assert read_devices(path) == (Met(OTHER, 5),)


def test_without_a_file_or_a_disk_the_device_is_known_until_the_process_ends(path: Path) -> None:
    known = known_at(None)
    assert [known.admits(one) for one in (FIRST, OTHER)] == [True, False]
    assert known.accept(OTHER, "ann", "", "proved") == ""
    assert known.admits(OTHER)
    known = known_at(path)
    path.parent.write_text("a file in the place of the folder")
    assert [known.admits(one) for one in (FIRST, OTHER)] == [True, False]
    assert codes(known) == ["device_learnt", "device_not_kept"]
    assert "cannot be written" in known.accept(OTHER, "ann", "", "proved")
    assert not known.admits(OTHER)
    path.parent.unlink()
    assert known.admits(FIRST)
    assert read_devices(path) == (Met(FIRST, 5),)


class Line:
    """What a device answers when it is asked for its identification, one answer a question."""

    def __init__(self, *answers: dict[int, str] | ModbusError) -> None:
        self._answers: Iterator[dict[int, str] | ModbusError] = iter(answers)

    def __call__(self) -> dict[int, str]:
        answer = next(self._answers)
        if isinstance(answer, ModbusError):
            raise answer
        return answer


TELLS = {0: "Acme", 1: "RX-2", 2: "V1.0", 0x80: "no. 4711"}
SILENT = ModbusError("no identification in time")
NONE = NoIdentificationError("none")


def checked(known: KnownDevice, *answers: dict[int, str] | ModbusError) -> Callable[[], None]:
    who = Identification(Line(*answers), "", "10.0.0.5:502")
    who.known = known
    return who.check


def test_a_new_firmware_is_no_other_device(path: Path) -> None:
    known = known_at(path)
    check = checked(known, TELLS, TELLS | {2: "V1.1"}, TELLS | {0x80: "no. 4712"})
    check()
    check()
    assert known.expected == "Acme, RX-2, no. 4711"
    with pytest.raises(RefusedError, match=r"another device, 'Acme, RX-2, no. 4712', expected 'Ac"):
        check()


def test_a_device_that_never_answers_the_question_is_taken_as_it_is(path: Path) -> None:
    known = known_at(path)
    check = checked(known, *[SILENT] * 5, NONE, TELLS)
    for _ in range(7):
        check()
    assert known.expected == "Acme, RX-2, no. 4711"


def test_a_known_device_is_asked_again_before_silence_counts_as_another_one(path: Path) -> None:
    known = known_at(path)
    check = checked(known, TELLS, SILENT, SILENT, TELLS, SILENT, SILENT, SILENT, NONE)
    check()
    for _ in range(2):
        with pytest.raises(ModbusError, match="in time"):
            check()
    check()
    for _ in range(2):
        with pytest.raises(ModbusError, match="in time"):
            check()
    for _ in range(2):
        with pytest.raises(RefusedError, match="another device, without identification"):
            check()
    assert known.refused == ""
