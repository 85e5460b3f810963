"""A client of another account of this machine: python -m tests.access.other_account CONFIG MODEL.

Started as root, since the account may not be able to read this Python; it imports what it needs,
becomes the other account for good, and asks the monitor for another model. Prints its user id and
what it was told: with the rig's configuration, and with a secret of its own.
"""

import json
import os
import sys
import tempfile
from pathlib import Path

from msgspec import structs

from rigwatch.wire.access import signer_of
from rigwatch.wire.access.account_secret import own_secret, secret_file
from rigwatch.wire.bus import ModelRequest, ask_for_model, connect
from rigwatch.wire.bus.zenoh_transport import ZenohTransport
from rigwatch.wire.errors import KeysError
from rigwatch.wire.rig_config import RigConfig, SecuritySection, load_rig

OTHER = 65534


def become_other() -> None:
    """Give up all rights of root."""
    os.setgroups([])
    os.setgid(OTHER)
    os.setuid(OTHER)


def told(config: RigConfig, request: ModelRequest) -> str:
    """What the monitor answers, or why the client could not even ask."""
    bus = connect(config, f"other-{os.getpid()}", 30.0)
    try:
        return ask_for_model(bus, request, 30.0).text
    except KeysError as error:
        return str(error)
    finally:
        bus.close()


def main(path: str, model: str) -> None:
    """Ask twice."""
    assert ZenohTransport
    with tempfile.TemporaryDirectory() as folder:  # a rehearsal loads all modules and codecs
        security = SecuritySection(secret=f"{folder}/secret")
        own_secret(secret_file(security))
        signer_of(security, "").sign("rehearsal", (), ())
    request = ModelRequest("promote", Path(model).read_text(encoding="utf-8"), "eve", "")
    become_other()
    config = load_rig(path)
    with tempfile.TemporaryDirectory() as folder:
        own = structs.replace(config.bus.security, secret=f"{folder}/secret")
        own_secret(secret_file(own))
        other = structs.replace(config, bus=structs.replace(config.bus, security=own))
        answers = told(config, request), told(other, request)
    print(json.dumps([os.geteuid(), *answers]))


if __name__ == "__main__":
    main(*sys.argv[1:])
