"""Foreign files are read in a process of their own, with bounded memory."""

from pathlib import Path

import pytest

from rigwatch.browser.recordings.file_contents import contents_of
from rigwatch.browser.work.apart import ApartError, apart
from rigwatch.browser.work.study_process import warm_up

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
