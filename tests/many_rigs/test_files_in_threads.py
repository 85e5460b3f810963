"""Threads that meet a kind of file at the same time, as the rigs of a process do at its start."""

import subprocess
import sys

from tests.bus.rig import ROOT

ROUNDS = 60
READ = """
import sys, threading
from typing import Annotated
from msgspec import Meta
from rigwatch.wire.typed_files import Section, converted, json_value

sys.setswitchinterval(1e-6)
SIZE = "Annotated[float, Meta(ge=0, description='size')] | None"

def kind_that_nobody_has_met():
    inner = None
    for level in range(6):
        fields = {f"n{number}": SIZE for number in range(12)}
        content = dict.fromkeys(fields) | {"__module__": "__main__"}
        if inner is not None:
            fields["inner"] = inner | None
            content["inner"] = None
        inner = type(Section)(f"Level{level}", (Section,), content | {"__annotations__": fields})
    return inner

def read(kind, meet):
    meet.wait()
    found.append(converted({"n1": 2.0}, kind, "a.toml").n1)
    found.append(json_value(b'{"n1": 2.0}', kind).n1)

found = []
for _ in range(int(sys.argv[1])):
    kind, meet = kind_that_nobody_has_met(), threading.Barrier(8)
    threads = [threading.Thread(target=read, args=(kind, meet)) for _ in range(8)]
    for one in threads:
        one.start()
    for one in threads:
        one.join()
print(len(found), set(found))
"""


def test_threads_that_read_a_kind_of_file_for_the_first_time_all_read_it() -> None:
    run = subprocess.run(
        [sys.executable, "-c", READ, str(ROUNDS)],
        cwd=ROOT,
        capture_output=True,
        text=True,
        check=False,
    )
    assert run.returncode == 0, run.stderr
    assert run.stdout.split() == [str(16 * ROUNDS), "{2.0}"]
