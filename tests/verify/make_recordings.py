"""Makes the recordings and the model of this folder anew: `python -m tests.verify.make_recordings`.

Only for when the simulated rig or the session format changes; afterwards run
`rigwatch verify tests/verify/cases.toml --update` and look at what changed.
"""

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from rigwatch.commands import main
from rigwatch.simulated import simulate, write_session
from rigwatch.wire.messages import quality_flags as quality
from rigwatch.wire.messages.blocks import cut
from rigwatch.wire.messages.message_types import AlarmCommand, Column, SampleBlock
from rigwatch.wire.session import SessionWriter, run_info

FOLDER = Path(__file__).parent
SCENARIOS = FOLDER.parents[1] / "configs" / "scenarios"
COMMISSIONING = {
    "chirp": "commissioning_chirp",
    "healthy": "healthy_sine_8hz_1v4",
    "friction": "known_friction",
}


def make() -> None:
    """Model and recordings, in place of those that are there."""
    with TemporaryDirectory() as folder:
        arguments = []
        for role, scenario in COMMISSIONING.items():
            path = Path(folder, f"{role}.mcap")
            write_session(path, SCENARIOS / f"{scenario}.toml")
            arguments += [f"--{role}", str(path)]
        main([
            "commission", *arguments, "--scheme", "transfer",
            "--output", str(FOLDER / "model.toml"),
        ])  # fmt: skip
    for name, scenario in (("friction", "experiment_2"), ("stiction", "experiment_7")):
        path = FOLDER / f"{name}.mcap"
        path.unlink(missing_ok=True)
        write_session(path, SCENARIOS / f"{scenario}.toml")
    _write_troubled(FOLDER / "troubled.mcap")


def _write_troubled(path: Path) -> None:
    """A friction fault in a bad recording: a gap, invalid samples, a restart, an operator."""
    path.unlink(missing_ok=True)
    (whole,) = simulate(SCENARIOS / "experiment_2.toml", block=1 << 20)
    t_ns = int(whole.t_ns[1000])
    with SessionWriter(path, run_info("simulated", 256.0, t_ns=int(whole.t_ns[0]))) as writer:
        for block in _troubled(whole):
            writer.write(block)
        writer.write(AlarmCommand("*", "acknowledge", "anna", t_ns, "seen"))


def _troubled(whole: SampleBlock) -> Iterator[SampleBlock]:
    whole = _spoilt(whole, "position", slice(500, 503), np.nan, quality.NON_FINITE)
    whole = _spoilt(whole, "acceleration", slice(1100, 1140), 490.0, quality.SATURATED)
    yield cut(whole, 0, 700)
    yield cut(whole, 704, 1400)
    restarted = cut(whole, 1400, len(whole))
    yield replace(restarted, boot=whole.boot + 1, seq=0)


def _spoilt(block: SampleBlock, name: str, part: slice, value: float, flag: int) -> SampleBlock:
    channels = []
    for column in block.channels:
        values, flags = column.values.copy(), column.quality.copy()
        if column.name == name:
            values[part], flags[part] = value, flag
        channels.append(Column(column.name, column.unit, values, flags))
    return replace(block, channels=tuple(channels))


if __name__ == "__main__":
    make()
