"""What a receiver of commands accepts: the operator's own signature, for this run, once."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import msgspec
import pytest

from rigwatch.keys import Authority
from rigwatch.wire.access import Signer, Verifier, operator_name
from rigwatch.wire.access.replays import KEPT, Replays
from rigwatch.wire.access.statement import LARGEST_PROOF, Proof, read_proof, statement
from rigwatch.wire.bus import CommandCheck, ModelRequest
from rigwatch.wire.bus.commands.command_check import signed
from rigwatch.wire.bus.memory_transport import MemoryNetwork
from rigwatch.wire.errors import KeysError
from rigwatch.wire.messages import AlarmCommand
from rigwatch.wire.rig_config import BusSection, SecuritySection
from tests.access.secured_rig import make_keys, operator_bus

SAID = ("AlarmCommand", "dry_friction", "acknowledge", "ann", "5", "")


@pytest.fixture(scope="module")
def keys(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return make_keys(tmp_path_factory.mktemp("signing") / "keys")


@pytest.fixture
def verifier(keys: Path) -> Verifier:
    return Verifier(keys, "bench")


def proof_of(verifier: Verifier, keys: Path, name: str = "ann", rig: str = "bench") -> str:
    return Signer(keys, name).sign(rig, (verifier.run,), SAID)


def test_a_signed_command_is_accepted_once(keys: Path, verifier: Verifier) -> None:
    proof = proof_of(verifier, keys)
    verifier.check("ann", proof, SAID)
    with pytest.raises(KeysError, match="received before"):
        verifier.check("ann", proof, SAID)
    verifier.check("ann", proof_of(verifier, keys), SAID)


@pytest.mark.parametrize("field", range(len(SAID)))
def test_a_changed_field_breaks_the_signature(keys: Path, verifier: Verifier, field: int) -> None:
    changed = (*SAID[:field], SAID[field] + "x", *SAID[field + 1 :])
    with pytest.raises(KeysError, match="signature does not match"):
        verifier.check("ann", proof_of(verifier, keys), changed)


def test_fields_cannot_be_moved_into_each_other() -> None:
    proof = Proof("", ("r",), "n", 1)
    assert statement("rig", proof, ("ab", "c")) != statement("rig", proof, ("a", "bc"))
    assert statement("rig", proof, ("a",)) != statement("rig", proof, ("a", ""))


@pytest.mark.parametrize(
    ("change", "why"),
    [
        (lambda p: replace_in(p, nonce="0" * 32), "signature does not match"),
        (lambda p: replace_in(p, t_ns=1), "signature does not match"),
        (lambda p: replace_in(p, runs=(*read_proof(p).runs, "x")), "signature does not match"),
        (lambda p: replace_in(p, signature="zz"), "signature does not match"),
        (lambda p: replace_in(p, certificate="none"), "certificate cannot be read"),
        (lambda _: "", "not signed"),
        (lambda _: "[" * 5000, "proof cannot be read"),
        (lambda _: '{"t_ns": ' + "9" * 5000 + "}", "proof cannot be read"),
        (lambda _: "x" * (LARGEST_PROOF + 1), "expected at most"),
    ],
)
def test_a_changed_proof_is_refused(
    keys: Path, verifier: Verifier, change: Callable[[str], str], why: str
) -> None:
    with pytest.raises(KeysError, match=why):
        verifier.check("ann", change(proof_of(verifier, keys)), SAID)


def replace_in(text: str, **fields: object) -> str:
    return msgspec.structs.replace(read_proof(text), **fields).to_text()


def test_another_user_rig_run_or_role_is_refused(keys: Path, verifier: Verifier) -> None:
    with pytest.raises(KeysError, match="it is signed by bob, expected ann"):
        verifier.check("ann", proof_of(verifier, keys, "bob"), SAID)
    with pytest.raises(KeysError, match="signature does not match"):
        verifier.check("ann", proof_of(verifier, keys, rig="other"), SAID)
    with pytest.raises(KeysError, match="another run"):
        verifier.check("ann", proof_of(Verifier(keys, "bench"), keys), SAID)
    with pytest.raises(KeysError, match="daq has the role daq, expected operator"):
        verifier.check("daq", proof_of(verifier, keys, "daq"), SAID)


def test_another_authority_is_refused(verifier: Verifier, tmp_path: Path) -> None:
    other = make_keys(tmp_path / "other")
    with pytest.raises(KeysError, match="of another authority"):
        verifier.check("ann", proof_of(verifier, other), SAID)


def test_a_revocation_is_in_force_at_once(tmp_path: Path) -> None:
    folder = make_keys(tmp_path / "keys")
    verifier = Verifier(folder, "bench")
    verifier.check("ann", proof_of(verifier, folder), SAID)
    Authority(folder).revoke("ann")
    with pytest.raises(KeysError, match="certificate of ann is revoked"):
        verifier.check("ann", proof_of(verifier, folder), SAID)
    verifier.check("bob", proof_of(verifier, folder, "bob"), SAID)
    Authority(folder).issue("ann", "operator")
    verifier.check("ann", proof_of(verifier, folder), SAID)
    (folder / "register.json").write_text("{")
    with pytest.raises(KeysError, match="register cannot be read"):
        verifier.check("ann", proof_of(verifier, folder), SAID)


def test_replays_are_refused_in_bounded_memory() -> None:
    replays, count = Replays(), 3 * KEPT
    assert all(replays.is_new(str(n), n) for n in range(count))
    assert not any(replays.is_new(str(n), n) for n in range(count))
    assert len(replays._nonces) == KEPT


def test_alarm_and_model_commands_are_signed_for_all_receivers(keys: Path) -> None:
    network = MemoryNetwork()
    checks = [
        CommandCheck(network.bus("bench", name), SecuritySection(keys=str(keys)))
        for name in ("monitor", "witness")
    ]
    ann = operator_bus(network, keys, "ann")
    command = signed(ann, AlarmCommand("*", "acknowledge", "ann", 5))
    change = signed(ann, ModelRequest("rollback", "", "ann", "worse"))
    for check in checks:
        assert check.judge(command).identity == "proved"
        assert check.judge(change).identity == "proved"
        assert "signed by ann, expected bob" in check.judge(replace(change, user="bob")).refusal
        assert check.judge(replace(command, proof=change.proof)).refusal
        assert check.refused == 2


def test_the_user_is_the_certificates() -> None:
    secured = BusSection(security=SecuritySection(keys="keys", operator="ann"))
    assert operator_name(secured) == "ann"
    assert operator_name(BusSection(), "bob") == "bob"
    assert operator_name(BusSection())
    with pytest.raises(KeysError, match="user: found bob, expected ann"):
        operator_name(secured, "bob")
