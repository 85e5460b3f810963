"""A key of mapping or case files that docs/sessions.md does not name fails here; so do examples."""

import tomllib
from pathlib import Path

import msgspec
import pytest

from rigwatch.replay.cases import Case
from rigwatch.wire.exchange.mapping import ImportMapping
from rigwatch.wire.typed_files.loading import Section, load

ROOT = Path(__file__).parents[2]
PAGE = (ROOT / "docs" / "sessions.md").read_text(encoding="utf-8")


@pytest.mark.parametrize("kind", [ImportMapping, Case])
def test_every_key_is_documented(kind: type[Section]) -> None:
    missing = [f.name for f in msgspec.structs.fields(kind) if f"`{f.name}`" not in PAGE]
    assert missing == []


def test_examples_in_toml_can_be_read() -> None:
    blocks = [part.split("```")[0] for part in PAGE.split("```toml")[1:]]
    assert len(blocks) == 2
    mapping = msgspec.convert(tomllib.loads(blocks[0]), ImportMapping)
    assert mapping.channels["position"] == "qm[mm]"
    assert msgspec.convert(tomllib.loads(blocks[1])["case"][0], Case).name == "friction"


@pytest.mark.parametrize("path", sorted((ROOT / "configs" / "imports").glob("*.toml")))
def test_every_mapping_that_ships_can_be_read(path: Path) -> None:
    assert load(path, ImportMapping).channels
