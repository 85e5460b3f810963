"""`rigwatch commission` on recordings with faults of their own, and where its model goes."""

import io
import re
from collections.abc import Callable
from contextlib import redirect_stderr
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from monitor.model import load_model, model_versions
from rigwatch.commands import main
from rigwatch.wire.messages import Column, SampleBlock, cut
from rigwatch.wire.messages import quality_flags as quality
from rigwatch.wire.session import SessionWriter, open_session
from rigwatch.wire.typed_files.shipped import find_config

SCENARIOS = {
    "chirp": "commissioning_multisine",
    "healthy": "healthy_sine_8hz_1v2",
    "friction": "known_friction",
}
Change = Callable[[SampleBlock], SampleBlock | list[SampleBlock]]


@pytest.fixture(scope="module")
def runs(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    """The recordings of a simulated rig."""
    folder = tmp_path_factory.mktemp("runs")
    for role, name in SCENARIOS.items():
        scenario = str(find_config(f"scenarios/{name}.toml"))
        assert main(["plant", "--session", str(folder / f"{role}.mcap"), scenario]) == 0
    return {role: folder / f"{role}.mcap" for role in SCENARIOS}


def changed(source: Path, target: Path, change: Change) -> Path:
    """A recording with every block changed, or in parts."""
    session = open_session(source)
    with SessionWriter(target, session.info, sync=False) as writer:
        for block in session.samples():
            made = change(block)
            for one in made if isinstance(made, list) else [made]:
                writer.write(one)
    return target


def commission(runs: dict[str, Path], output: Path, *more: str, **instead: Path) -> int:
    words = [word for role, path in (runs | instead).items() for word in (f"--{role}", str(path))]
    return main(["commission", *words, "--scheme", "transfer", "--output", str(output), *more])


@pytest.fixture(scope="module")
def commissioned(
    runs: dict[str, Path], tmp_path_factory: pytest.TempPathFactory
) -> tuple[Path, str]:
    """The model of the unchanged recordings, in the place of another, and what was said."""
    output = tmp_path_factory.mktemp("commissioned") / "model.toml"
    output.write_text("# the model before\n")
    with redirect_stderr(io.StringIO()) as said:
        assert commission(runs, output) == 0
    return output, said.getvalue()


def with_column(block: SampleBlock, name: str, values: np.ndarray, unit: str = "") -> SampleBlock:
    """The block with other values of a channel."""
    columns = tuple(
        replace(one, values=values, unit=unit or one.unit) if one.name == name else one
        for one in block.channels
    )
    return replace(block, channels=columns)


def damaged(block: SampleBlock) -> SampleBlock:
    """Readings that are no numbers for 20 ms in the midst of a recording of 60 s."""
    values, at = (
        block.channel("position").values.copy(),
        np.arange(block.seq, block.seq + len(block)),
    )
    values[(at > 5000) & (at < 5006)] = np.nan
    return with_column(block, "position", values)


def saturated(block: SampleBlock) -> SampleBlock:
    """One sample beyond the converter's range every ten seconds."""
    at = np.arange(block.seq, block.seq + len(block))
    columns = []
    for one in block.channels:
        flags = np.where(at % 2560 == 1500, quality.SATURATED, 0).astype(np.uint8)
        columns.append(replace(one, quality=flags) if one.name == "acceleration" else one)
    return replace(block, channels=tuple(columns))


def lost(block: SampleBlock) -> list[SampleBlock]:
    """Without ten samples in the midst of each block."""
    half = len(block) // 2
    return [cut(block, 0, half - 10), cut(block, half, len(block))]


@pytest.mark.parametrize("change", [damaged, saturated, lost])
def test_only_invalid_samples_are_left_out(
    change: Change, runs: dict[str, Path], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    healthy = changed(runs["healthy"], tmp_path / "healthy.mcap", change)
    assert commission(runs, tmp_path / "model.toml", healthy=healthy) == 0
    assert "healthy.mcap: " in capsys.readouterr().err
    whole = sum(map(len, open_session(healthy).samples()))
    model = load_model(tmp_path / "model.toml")
    used = sum(reference.periods * len(reference.voltage) for reference in model.reference)
    assert used > 0.5 * whole
    assert len([one for one in model.recording if one.role == "healthy"]) > 1


def test_a_broken_sensor_that_the_model_does_not_need_is_noted(
    runs: dict[str, Path],
    commissioned: tuple[Path, str],
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
) -> None:
    def beside(block: SampleBlock) -> SampleBlock:
        broken = Column("temperature", "degC", np.full(len(block), np.nan))
        return replace(block, channels=(*block.channels, broken))

    healthy = changed(runs["healthy"], tmp_path / "healthy.mcap", beside)
    assert commission(runs, tmp_path / "other.toml", healthy=healthy) == 0
    assert "temperature: 15360 invalid samples" in capsys.readouterr().err
    assert load_model(tmp_path / "other.toml") == load_model(commissioned[0])


def reversed_sign(block: SampleBlock) -> SampleBlock:
    return with_column(block, "position", -block.channel("position").values)


def ten_times(block: SampleBlock) -> SampleBlock:
    return with_column(block, "acceleration", 10.0 * block.channel("acceleration").values)


def in_millimetres(block: SampleBlock) -> SampleBlock:
    return with_column(block, "position", 1e3 * block.channel("position").values)


def swapped(block: SampleBlock) -> SampleBlock:
    voltage, position = (block.channel(name).values for name in ("voltage", "position"))
    return with_column(with_column(block, "voltage", position), "position", voltage)


@pytest.mark.parametrize(
    ("change", "reason"),
    [
        (reversed_sign, "opposite sign"),
        (ten_times, "9.7 times"),
        (in_millimetres, "0.000969 times"),
        (swapped, "swapped|times"),
    ],
)
def test_wrong_wiring_is_refused_unless_it_is_wanted(
    change: Change,
    reason: str,
    runs: dict[str, Path],
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
) -> None:
    wrong = {r: changed(p, tmp_path / f"{r}.mcap", change) for r, p in runs.items()}
    capsys.readouterr()
    assert commission(wrong, tmp_path / "model.toml") == 2
    said = capsys.readouterr().err
    assert re.search(rf"chirp.mcap: wiring: found .*({reason})", said), said
    assert "--any-wiring" in said
    assert not (tmp_path / "model.toml").exists()
    commission(wrong, tmp_path / "model.toml", "--any-wiring")
    assert "s of recordings: this takes about" in capsys.readouterr().err  # the work begins


def test_the_model_of_a_wiring_that_is_wanted_has_it_accepted(
    runs: dict[str, Path], tmp_path: Path
) -> None:
    loud = {r: changed(p, tmp_path / f"{r}.mcap", ten_times) for r, p in runs.items()}
    assert commission(loud, tmp_path / "model.toml", "--any-wiring") == 0
    assert load_model(tmp_path / "model.toml").accepted_wiring == ("wiring_scale",)


def test_the_model_before_is_kept_with_its_history(commissioned: tuple[Path, str]) -> None:
    output, said = commissioned
    assert "about" in said
    assert "model.v1.toml" in said
    assert output.with_name("model.v1.toml").read_text() == "# the model before\n"
    (line,) = model_versions.history(output)
    assert (line.step, line.sha256) == ("commission", model_versions.digest_of(output))


def test_a_place_that_cannot_be_written_is_refused_before_the_work(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    nowhere = dict.fromkeys(SCENARIOS, tmp_path / "none.mcap")
    assert commission(nowhere, tmp_path / "no" / "model.toml") == 2
    assert "expected a file to write" in capsys.readouterr().err
