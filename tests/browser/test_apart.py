"""Foreign files are read in a process of their own, with bounded memory."""

import json
import os
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest

from rigwatch.browser.recordings.file_contents import contents_of
from rigwatch.browser.server.import_routes import MOST_PREVIEW
from rigwatch.browser.work.apart import MOST_WAITING, ApartError, apart
from rigwatch.browser.work.study_process import warm_up
from tests.browser.page import Served
from tests.browser.test_access import ask
from tests.waiting import eventually

pytestmark = pytest.mark.xdist_group("browser")


@pytest.fixture(scope="module")
def table(tmp_path_factory: pytest.TempPathFactory) -> Path:
    found = tmp_path_factory.mktemp("apart") / "table.csv"
    found.write_text("t,a\n" + "".join(f"{k},{k}.5\n" for k in range(200_000)))
    warm_up()
    return found


def test_a_result_and_a_refusal_come_back(table: Path) -> None:
    assert apart(contents_of, table).rows == 200_000
    with pytest.raises(ApartError, match=r"no\.csv: cannot be read: no such file"):
        apart(contents_of, table.with_name("no.csv"))


def test_a_file_that_needs_too_much_memory_is_refused(table: Path) -> None:
    with pytest.raises(ApartError, match="more than 16 MB of memory, expected a smaller file"):
        apart(contents_of, table, memory=16 << 20)


MAPPING = {"channels": {"position": "x[m]"}, "time": "t[s]"}
REQUESTS = 46
"""More than the server has threads for its requests: 40."""


@pytest.mark.nightly
def test_files_that_wait_to_be_read_keep_no_other_page_waiting(
    served: Served,
) -> None:
    log = b"t[s],x[m]\n" + b"".join(b"%.3f,1.0\n" % (0.01 * row) for row in range(50_000))
    status, told = ask(served, "/api/upload/slow.csv", "PUT", body=log)
    assert status == 200
    wanted = json.dumps({"upload": json.loads(told)["upload"], "mapping": MAPPING}).encode()

    def preview(_: int) -> tuple[int, str]:
        return ask(served, "/api/import-preview", "POST", body=wanted)

    with ThreadPoolExecutor(REQUESTS) as threads:
        asked = [threads.submit(preview, number) for number in range(REQUESTS)]
        eventually(lambda: any(one.done() for one in asked), "the first answer")
        before = sum(one.done() and one.result()[0] == 200 for one in asked)
        assert ask(served, "/api/recordings")[0] == 200
        assert sum(one.done() and one.result()[0] == 200 for one in asked) <= before + 2
        found = [one.result() for one in asked]
    refused = [text for status, text in found if status == 409]
    assert refused
    assert all("other files are to be read first" in text for text in refused)
    read = [text for status, text in found if status == 200]
    assert len(read) > MOST_WAITING, "one is read, so many wait"
    assert len(read) + len(refused) == REQUESTS


def test_no_preview_is_made_of_a_huge_file(served: Served) -> None:
    status, told = ask(served, "/api/upload/long.csv", "PUT", body=b"t[s],x[m]\n0,0\n1,0\n2,0\n")
    upload = json.loads(told)["upload"]
    (source,) = served.folder.rglob("long.csv")
    os.truncate(source, MOST_PREVIEW + 1)  # a hole: no disk is filled
    wanted = json.dumps({"upload": upload, "mapping": MAPPING}).encode()
    status, told = ask(served, "/api/import-preview", "POST", body=wanted)
    assert (status, "long.csv: found 64 MB, expected at most 64 MB for a preview" in told) == (
        409,
        True,
    )
    source.unlink()
