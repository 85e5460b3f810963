"""Verification cases: recordings, models and what may differ, declared in a TOML file.

[[case]]
name = "friction"
recording = "friction.mcap"         paths are relative to the file
model = "model.toml"
reference = "friction.reference.mcap"
block = 8                           samples passed at a time
ignore = ["condition.gap.*"]        fields that are not compared
tolerance = { theta2 = 1e-4 }       relative to the field's largest value
"""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

from msgspec import Meta, field

from rigwatch.replay.choice import monitor_for
from rigwatch.replay.compare import Difference, Rules, compare
from rigwatch.replay.reference import Output, output_of, read_reference, write_reference
from rigwatch.wire.session import Session, open_session
from rigwatch.wire.typed_files import Section, load

Text = Annotated[str, Meta(min_length=1)]


class Case(Section, frozen=True):
    """One case."""

    name: Annotated[Text, Meta(description="name in reports")]
    recording: Annotated[Text, Meta(description="session file or folder")]
    model: Annotated[Text, Meta(description="model file")]
    reference: Annotated[Text, Meta(description="session file with the reference")]
    config: Annotated[
        str, Meta(description="configuration of the rig; empty: the recorded one")
    ] = ""
    block: Annotated[int, Meta(ge=1, description="samples passed at a time")] = 8
    ignore: Annotated[tuple[Text, ...], Meta(description="patterns of fields not compared")] = ()
    tolerance: Annotated[
        dict[Text, Annotated[float, Meta(ge=0)]],
        Meta(description="tolerance by pattern of field, relative to the field's largest value"),
    ] = field(default_factory=dict)


class CaseFile(Section, frozen=True):
    """The whole file."""

    case: Annotated[tuple[Case, ...], Meta(min_length=1, description="the cases")]


@dataclass(frozen=True, slots=True)
class Verdict:
    """The result of one case.

    Attributes:
        name: the case.
        samples: samples judged.
        fields: fields published.
        differences: differences from the reference.
        has_reference: whether there is one.
        updated: whether the reference was rewritten.
    """

    name: str
    samples: int
    fields: int
    differences: tuple[Difference, ...]
    has_reference: bool
    updated: bool

    @property
    def passed(self) -> bool:
        """Whether everything agrees with the reference, or the reference was rewritten."""
        return self.updated or (self.has_reference and not self.differences)


def load_cases(path: Path) -> tuple[Case, ...]:
    """The cases in the file at `path`.

    Raises:
        ConfigError: the file is wrong.
    """
    return load(path, CaseFile).case


def verify(case: Case, folder: Path, *, update: bool = False) -> Verdict:
    """Replay one case and compare; with `update`, rewrite a reference that differs.

    Args:
        case: the case to replay.
        folder: base of the case's relative paths.
        update: rewrite a reference that differs.

    Raises:
        RigwatchError: recording, model, configuration or reference cannot be read.
    """
    session = open_session(folder / case.recording)
    new = replayed(case, folder, session, case.block)
    path = folder / case.reference
    known = path.exists()
    rules = Rules(case.ignore, case.tolerance)
    differences = compare(read_reference(path), new, rules) if known else []
    renew = update and (not known or bool(differences))
    if renew:
        write_reference(path, session.info, new)
    fields = len(new.blocks[0].columns) if new.blocks else 0
    return Verdict(case.name, new.samples, fields, tuple(differences), known, renew)


def replayed(case: Case, folder: Path, session: Session, block: int) -> Output:
    """What the monitor publishes over the case's recording, in blocks of `block` samples."""
    config = folder / case.config if case.config else None
    return output_of(session, monitor_for(session, folder / case.model, config), block)
