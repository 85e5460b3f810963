"""A rig without keys accepts changes from the account that runs it, and from nobody else."""

import json
import os
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path

import msgspec
import pytest

from monitor.model import load_model, model_text
from rigwatch.wire.access import Signer, signer_of, verifier_of
from rigwatch.wire.access.account_secret import own_secret, secret_file
from rigwatch.wire.access.statement import read_proof
from rigwatch.wire.bus import (
    Bus,
    ModelRequest,
    ask_alarm_list,
    ask_for_model,
    command_alarms,
    connect,
)
from rigwatch.wire.errors import BusError, KeysError
from rigwatch.wire.messages import COMMANDS, EVENTS, HEALTH, AlarmCommand
from rigwatch.wire.rig_config import SecuritySection, load_rig
from tests.access.secured_rig import make_keys
from tests.bus.rig import ROOT, TestRig, kill, rigwatch
from tests.monitor_process.model import monitor_section
from tests.waiting import PATIENCE, eventually

NOBODY = 65534
SAID = ("ModelRequest", "promote", "noise = 1000", "eve", "")


@pytest.fixture
def security(tmp_path: Path) -> SecuritySection:
    return SecuritySection(secret=str(tmp_path / "own" / "commands.secret"))


def test_the_secret_is_made_once_and_for_its_account_only(security: SecuritySection) -> None:
    path = secret_file(security)
    made = own_secret(path)
    assert path.stat().st_mode & 0o777 == 0o600
    assert path.parent.stat().st_mode & 0o777 == 0o700
    assert own_secret(path) == made
    assert [one.name for one in path.parent.iterdir()] == [path.name]
    assert len(set(bytes.fromhex(made.decode()))) > 8


@pytest.mark.parametrize(
    ("spoil", "why"),
    [
        (lambda path: path.chmod(0o644), "other accounts have access .mode 644."),
        (lambda path: path.write_text(""), "found no secret"),
        (lambda path: path.rename(path.with_name("x")).exists() and path.symlink_to("x"), "symb"),
        (lambda path: path.unlink() or os.mkfifo(path, 0o600), "found no secret"),
    ],
)
def test_a_secret_that_others_may_know_is_refused(
    security: SecuritySection, spoil: Callable[[Path], object], why: str
) -> None:
    path = secret_file(security)
    own_secret(path)
    spoil(path)
    with pytest.raises(KeysError, match=why):
        own_secret(path)


@pytest.mark.skipif(os.geteuid() != 0, reason="only root can make files of another account")
def test_a_secret_of_another_account_is_refused(security: SecuritySection) -> None:
    path = secret_file(security)
    own_secret(path)
    os.chown(path, NOBODY, NOBODY)
    with pytest.raises(KeysError, match="belongs to another account"):
        own_secret(path)


def test_a_command_of_the_account_is_accepted_once(security: SecuritySection) -> None:
    verifier = verifier_of(security, "bench")
    proof = signer_of(security, "").sign("bench", ("x", verifier.run), SAID)
    verifier.check("eve", proof, SAID)
    with pytest.raises(KeysError, match="received before"):
        verifier.check("eve", proof, SAID)
    with pytest.raises(KeysError, match="another run"):
        verifier_of(security, "bench").check("eve", proof, SAID)


@pytest.mark.parametrize("field", range(len(SAID)))
def test_a_changed_field_is_refused(security: SecuritySection, field: int) -> None:
    verifier = verifier_of(security, "bench")
    proof = signer_of(security, "").sign("bench", (verifier.run,), SAID)
    changed = (*SAID[:field], SAID[field] + "x", *SAID[field + 1 :])
    with pytest.raises(KeysError, match="not signed with the secret"):
        verifier.check("eve", proof, changed)


def test_other_proofs_are_refused(security: SecuritySection, tmp_path: Path) -> None:
    verifier = verifier_of(security, "bench")
    own, runs = signer_of(security, ""), (verifier.run,)
    another = SecuritySection(secret=str(tmp_path / "another" / "commands.secret"))
    own_secret(secret_file(another))
    proof = own.sign("bench", runs, SAID)
    forged = [
        signer_of(another, "").sign("bench", runs, SAID),
        own.sign("other", runs, SAID),
        Signer(make_keys(tmp_path / "keys"), "ann").sign("bench", runs, SAID),
        *(
            msgspec.structs.replace(read_proof(proof), **change).to_text()
            for change in ({"nonce": "0"}, {"t_ns": 1}, {"runs": ("x",)}, {"signature": "ä"})
        ),
    ]
    for text in forged:
        with pytest.raises(KeysError, match="not signed with the secret"):
            verifier.check("eve", text, SAID)
    with pytest.raises(KeysError, match="it is not signed"):
        verifier.check("eve", "", SAID)
    verifier.check("eve", proof, SAID)


def test_a_secret_that_cannot_be_made_refuses_commands_and_nothing_else(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    security = SecuritySection(secret=str(tmp_path / "file" / "secret"))
    verifier = verifier_of(security, "bench")
    with pytest.raises(KeysError, match="secret of the rig cannot be read"):
        signer_of(security, "").sign("bench", (verifier.run,), SAID)
    with pytest.raises(KeysError, match="secret of the rig cannot be made"):
        verifier.check("eve", '{"certificate":"","runs":[],"nonce":"","t_ns":1}', SAID)


@pytest.fixture(scope="module")
def rig(tmp_path_factory: pytest.TempPathFactory) -> Iterator[TestRig]:
    """A rig in a folder that every account can read."""
    secret = tmp_path_factory.mktemp("account") / "own" / "commands.secret"
    with tempfile.TemporaryDirectory(prefix="rigwatch-test-") as made:
        folder = Path(made)
        folder.chmod(0o755)
        section = f'\n[bus.security]\nsecret = "{secret}"\n'
        with TestRig(folder, monitor_section(folder) + section) as rig:
            rig.router()
            rig.start("-m", "rigwatch", "monitor", str(rig.path))
            yield rig


def standing(bus: Bus) -> dict[str, str] | None:
    """Alarms by name; None while no monitor answers."""
    try:
        return {alarm.name: alarm.state for alarm in ask_alarm_list(bus)}
    except BusError:
        return None


def refused_count(bus: Bus) -> float:
    healths, found = bus.subscribe(HEALTH), list[float]()

    def said() -> bool:
        found.extend(
            h.counters["commands_refused"] for h in healths.drain() if h.source == "monitor"
        )
        return bool(found)

    eventually(said, "the monitor's health")
    healths.close()
    return found[-1]


def test_a_client_without_the_secret_changes_nothing(rig: TestRig) -> None:
    text = rig.path.read_text()
    publisher = rig.publisher(5, "--wave")
    own = rig.bus("ack-own")
    eventually(lambda: standing(own) is not None, "the monitor answers")
    path = rig.folder / "stranger.toml"
    own_folder = str(secret_file(rig.config.bus.security).parent)
    path.write_text(text.replace(own_folder, str(rig.folder / "elsewhere")))
    stranger = connect(load_rig(path), "stranger", PATIENCE)
    own_secret(rig.folder / "elsewhere" / "commands.secret")
    before = Path(str(rig.config.monitor.model)).read_bytes()  # type: ignore[union-attr]
    model = load_model(rig.config.monitor.model)  # type: ignore[union-attr]
    forged = ModelRequest("promote", model_text(model), "eve", "")

    count = refused_count(own)
    answer = ask_for_model(stranger, forged)
    assert not answer.done
    assert "not signed with the secret" in answer.text
    stranger.signer = None
    answer = ask_for_model(stranger, forged)
    assert "it is not signed" in answer.text
    answer = ask_for_model(stranger, ModelRequest("rollback", "", "eve", ""))
    assert not answer.done
    eventually(lambda: refused_count(own) == count + 3, "each is counted")

    kill(publisher)
    eventually(lambda: "stale" in (standing(own) or {}), "an alarm")
    events = stranger.subscribe(EVENTS)
    for action in ("acknowledge", "reset", "shelve"):
        stranger.publish(COMMANDS, AlarmCommand("stale", action, "eve", 1))  # type: ignore[arg-type]
    told: list[str] = []

    def all_told() -> bool:
        told.extend(e.text for e in events.drain() if e.code == "alarm_command_refused")
        return len(told) == 3

    eventually(all_told, "each refusal")
    assert all("it is not signed" in one for one in told)
    assert (standing(own) or {})["stale"] == "unacknowledged"
    assert refused_count(own) == count + 6
    assert Path(str(rig.config.monitor.model)).read_bytes() == before  # type: ignore[union-attr]
    stranger.close()

    # The account itself needs no further step.
    done = rigwatch("ack", str(rig.path), "stale")
    assert done.returncode == 0, done.stderr
    assert (standing(own) or {})["stale"] == "acknowledged"
    assert ask_for_model(own, replace(forged, user="ann")).done
    answer = command_alarms(own, AlarmCommand("nothing", "reset", "ann", 1))
    assert "no such alarm" in answer.refusal


@pytest.mark.skipif(os.geteuid() != 0, reason="only root can act as another account")
def test_another_account_cannot_read_the_secret_and_is_refused(rig: TestRig) -> None:
    own = rig.bus("observer")
    eventually(lambda: standing(own) is not None, "the monitor answers")
    secret = secret_file(rig.config.bus.security)
    eventually(secret.exists, "the secret")
    model = Path(str(rig.config.monitor.model))  # type: ignore[union-attr]
    before, stamp, count = model.read_bytes(), model.stat().st_mtime_ns, refused_count(own)
    client = [sys.executable, "-m", "tests.access.other_account", str(rig.path), str(model)]
    done = subprocess.run(
        client, cwd=ROOT, capture_output=True, text=True, timeout=PATIENCE, check=False
    )
    assert done.returncode == 0, done.stderr
    user, with_the_rigs, with_an_own = json.loads(done.stdout)
    assert user == NOBODY
    assert f"{secret}: secret of the rig cannot be read: permission denied" in with_the_rigs
    assert "not signed with the secret of the account" in with_an_own
    assert refused_count(own) == count + 1
    assert (model.read_bytes(), model.stat().st_mtime_ns) == (before, stamp)
