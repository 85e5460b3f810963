"""The example configurations of real rigs load, and ask for adapters that are installed."""

from pathlib import Path

import pytest

from daq.adapters import adapter_for
from rigwatch.wire.rig_config import load_rig

RIGS = sorted((Path(__file__).parents[2] / "configs" / "rigs").glob("*.toml"))


def test_there_is_one_for_each_kind_of_line() -> None:
    names = {path.stem for path in RIGS}
    assert {"serial", "modbus_tcp", "modbus_rtu"} <= names


@pytest.mark.parametrize("path", RIGS, ids=lambda path: path.stem)
def test_it_loads_and_names_what_is_to_be_changed(path: Path) -> None:
    config = load_rig(path)
    adapter = adapter_for(config.daq.device, config.channels)
    assert adapter.clock_rate == 1.0
    assert "# <-" in path.read_text(encoding="utf-8")
