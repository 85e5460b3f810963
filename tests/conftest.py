"""What holds for all tests: generated cases are judged by their outcome, never by their time."""

import atexit
import gc
import os
import shutil
import tempfile
from collections.abc import Generator

import pytest
from hypothesis import Phase, settings

from tests.made_once import SHARED

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # as the commands do, before NumPy is imported
# Processes of rigs make the secret of the account in the first, and workers what they share in the
# other; they inherit both.
for variable in ("XDG_STATE_HOME", SHARED):
    if variable not in os.environ:
        os.environ[variable] = tempfile.mkdtemp(prefix="rigwatch-tests-")
        atexit.register(shutil.rmtree, os.environ[variable], ignore_errors=True)
settings.register_profile("rigwatch", deadline=None, derandomize=os.environ.get("CI") == "true")
settings.register_profile(
    "mutation",  # of a change in the code it matters only whether a test fails, not how simply
    settings.get_profile("rigwatch"),
    max_examples=50,
    phases=[Phase.explicit, Phase.generate],
    derandomize=True,
)
settings.load_profile("rigwatch")


@pytest.hookimpl(wrapper=True)
def pytest_collection() -> Generator[None, object, object]:
    """Tests and what they import stay: garbage is looked for only in what is made later."""
    gc.disable()
    try:
        return (yield)
    finally:
        gc.freeze()
        gc.enable()


def pytest_itemcollected(item: pytest.Item) -> None:
    """Keep a file's tests in one worker, which makes what they share only once."""
    if item.get_closest_marker("xdist_group") is None:
        item.add_marker(pytest.mark.xdist_group(item.location[0]))


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Begin what takes long, so that no worker is left with it at the end."""
    items.sort(key=lambda item: item.get_closest_marker("long") is None)
