"""Prints docs/file-formats.md from the structs that read the files: `make docs` writes it."""

from collections.abc import Iterator

from rigwatch.physics.engine.equations import Composite, Effect, EffectMap, Model
from rigwatch.replay.cases import CaseFile
from rigwatch.structures.model import Structure
from rigwatch.wire.exchange import ImportMapping
from rigwatch.wire.typed_files import Section
from rigwatch.workbench.study import StudyFile
from tools.config_docs import sections

HEAD = """<!-- Printed by `make docs` from the descriptions in the code. -->

# File formats

TOML files that people write besides the [configuration of a rig](configuration.md). A key that is
misspelt, missing or out of range is refused with one line that names file, line and key.
"""
FILES: tuple[tuple[str, str, type[Section]], ...] = (
    (
        "Model",
        "Equations with ports where effects may enter; `model` in a study names one. Tables by "
        "name: `[inputs.voltage]`, `[states.x]`, `[parameters.m]`, `[outputs.position]`, "
        "`[ports.load]`. Examples: `rigwatch/physics/models/`.",
        Model,
    ),
    (
        "Effect",
        "An expression at a port, `[effects.NAME]` in a file of effects; `rigwatch add STUDY "
        "--effect-file FILE` copies it into a study. Examples: `rigwatch/physics/effects/`, "
        "[own effects](workbench.md#own-effects).",
        Effect,
    ),
    (
        "Composite",
        "An effect that acts through another, `[composites.NAME]` in a file of effects. Example: "
        "`rigwatch/physics/effects/composites.toml`, "
        "[effects in series](workbench.md#effects-in-series).",
        Composite,
    ),
    (
        "Map",
        "What lies between a force port and an effect, `[maps.NAME]` in a file of effects, as the "
        "first part of a composite.",
        EffectMap,
    ),
    (
        "Study",
        "`study.toml` in the folder of a study; `rigwatch study new` creates it from a template. "
        "Examples: `configs/studies/`, [study files](workbench.md#study-files).",
        StudyFile,
    ),
    (
        "Structure",
        "Masses, springs, dampers and loads: `[nodes.6]`, `[springs.k1_6]`. "
        "Examples: `configs/structures/`, [structures](structures.md#a-structure-file).",
        Structure,
    ),
    (
        "Import mapping",
        "Columns of a table as channels of a session, for `rigwatch import --mapping`. "
        "Examples: `configs/imports/`, [import](sessions.md#import).",
        ImportMapping,
    ),
    (
        "Verification cases",
        "Recordings and references for `rigwatch verify`. Example: `tests/verify/cases.toml`, "
        "[verify](sessions.md#verify).",
        CaseFile,
    ),
)


def page() -> str:
    """The whole page."""
    printed: set[type[Section]] = set()
    return HEAD + "\n".join(part for file in FILES for part in _file(*file, printed))


def _file(title: str, text: str, kind: type[Section], printed: set[type[Section]]) -> Iterator[str]:
    yield f"\n## {title}\n\n{text}\n"
    yield from sections(kind, 3, printed)
