"""A user's own machine: a model file, recordings made here, and the study of both."""

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from rigwatch.wire.exchange.importing import import_file
from rigwatch.wire.exchange.mapping import ImportMapping
from rigwatch.workbench.study.creation import create
from rigwatch.workbench.study.study import Study, open_study

Table = Mapping[str, np.ndarray]


def tones(
    draw: np.random.Generator, t: np.ndarray, low: float, high: float, count: int
) -> np.ndarray:
    """A sum of tones of size 1 at the times `t` [s], drawn between two frequencies [Hz]."""
    frequencies, phases = draw.uniform(low, high, count), draw.uniform(0, 6, count)
    return np.asarray(np.sin(2 * np.pi * t[:, None] * frequencies + phases).sum(axis=1))


def recorded(path: Path, table: Table, units: Mapping[str, str], rate: float = 100.0) -> None:
    """A session at `path`, by way of a CSV file."""
    lines = [",".join(table)]
    lines += [",".join(f"{v:.9g}" for v in row) for row in zip(*table.values(), strict=True)]
    source = path.with_suffix(".csv")
    source.write_text("\n".join(lines) + "\n")
    channels = {name: f"{name}[{units[name]}]" for name in table}
    import_file(source, path, ImportMapping(channels=channels, rate=rate, flag_missing=True))


def studied(  # noqa: PLR0917 -- a test helper
    folder: Path,
    model: str,
    train: Sequence[Table],
    held_out: Sequence[Table],
    units: Mapping[str, str],
    keys: str = "",
    rates: Sequence[float] = (),
) -> Study:
    """The study of a model file and recordings; `keys` are put into its file in front."""
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "model.toml").write_text(model)
    text = f'model = "model.toml"\n{keys}\n'
    given = iter(rates or [100.0] * (len(train) + len(held_out)))
    for use, tables in (("train", train), ("held_out", held_out)):
        for index, table in enumerate(tables):
            name = f"{use}{index}.mcap"
            recorded(folder / name, table, units, next(given))
            text += f'[[{use}]]\nsession = "{name}"\n'
    (folder / "template.toml").write_text(text)
    return create(folder / "study", folder / "template.toml")


def with_healthy(
    study: Study, healthy: Table, units: Mapping[str, str], rate: float = 100.0, keys: str = ""
) -> Study:
    """A study of `studied` with a healthy recording; `keys` are put behind it in its file."""
    recorded(study.folder.parent / "healthy.mcap", healthy, units, rate)
    with (study.folder / "study.toml").open("a") as file:
        file.write('\n[[healthy]]\nsession = "../healthy.mcap"\n' + keys)
    return open_study(study.folder)
