"""A file over a base: `base = "../base.toml"` names a file whose keys hold where this one has none.

    rig7.toml ──base──▶ hall2.toml ──base──▶ common.toml        keys of the left win

Tables are merged key by key, and tables of an array by their `name`; any other value is replaced. A
table of another kind (another `adapter`) replaces that of the base as a whole. An error names the
file that holds the key.
"""

import os
import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import msgspec

from rigwatch.wire.errors import ConfigError, reason_of
from rigwatch.wire.typed_files.explanation import explained, line_of
from rigwatch.wire.typed_files.loading import S, read_text, tables
from rigwatch.wire.typed_files.prepared import as_kind
from rigwatch.wire.typed_files.writing import as_toml

BASE, NAME = "base", "name"
MOST_LAYERS = 16
_STEP = re.compile(r"([^.\[\]]+)|\[(\d+)\]")
_Path = list[str | int]


@dataclass(frozen=True, slots=True)
class Layer:
    """One of the files: its path, its text, and the text as plain values."""

    file: Path
    text: str
    raw: dict[str, Any]


def load_layered(path: Path | str, kind: type[S], tag: str = "") -> S:
    """The file at `path` over its bases, as a struct of class `kind`.

    Args:
        path: the file.
        kind: the struct; it has a key `base`.
        tag: key by which tables of different kinds are told apart.

    Raises:
        ConfigError: a file cannot be read, is not TOML, or they are not a valid `kind` together.
    """
    layers = read_layers(path)
    raw = merged(layers, tag)
    try:
        return as_kind(raw, kind)
    except msgspec.ValidationError as error:
        raise _placed(explained(error, raw, kind, layers[0].text, path), layers, raw) from None


def read_layers(path: Path | str) -> list[Layer]:
    """The file at `path`, its base, the base of that, …

    Raises:
        ConfigError: one cannot be read or is not TOML, or they lead back to one another.
    """
    layers = [_layer(path)]
    while base := layers[-1].raw.get(BASE):
        named_in = layers[-1]
        if not isinstance(base, str):
            raise _of_base(named_in, repr(base), "the path of a file")
        try:
            file = _plain(named_in.file.parent / base)
            there = file.is_file()
            back = there and any(file.samefile(layer.file) for layer in layers)
        except OSError as error:  # a name that is too long, a share that does not answer
            raise _of_base(named_in, repr(base), f"a file; {reason_of(error)}") from None
        if not there:
            raise _of_base(named_in, repr(base), f"a file; there is no {file}")
        if back or len(layers) == MOST_LAYERS:
            raise _of_base(named_in, repr(base), "a file that does not lead back to this one")
        layers.append(_layer(file))
    return layers


def merged(layers: Sequence[Layer], tag: str = "") -> dict[str, Any]:
    """All layers as one tree, the first on top."""
    tree: dict[str, Any] = {}
    for layer in reversed(layers):
        tree = _over(layer.raw, tree, tag)
    return tree


def holder(path: Path | str, key: str) -> Path:
    """Which of the files of `path` holds the top-level `key`; the uppermost of several."""
    layers = read_layers(path)
    return next((layer.file for layer in layers if key in layer.raw), layers[0].file)


def whole_text(path: Path | str, tag: str = "") -> str:
    """The text of the file at `path`; of one with a base, the text of all together.

    Raises:
        ConfigError: as in `read_layers`.
    """
    layers = read_layers(path)
    if len(layers) == 1:
        return layers[0].text
    tree = {key: value for key, value in merged(layers, tag).items() if key != BASE}
    return f"# {', over '.join(layer.file.name for layer in layers)}\n{as_toml(tree)}"


def files_of(path: Path | str) -> list[Path]:
    """The file at `path`, its base, the base of that, …

    Raises:
        ConfigError: as in `read_layers`.
    """
    return [layer.file for layer in read_layers(path)]


def _layer(path: Path | str) -> Layer:
    text = read_text(Path(path))
    return Layer(Path(path), text, tables(text, path))


def _plain(path: Path) -> Path:
    """The path without `..`, unless that is another file, as beside a link to a folder."""
    short = Path(os.path.normpath(path))
    return short if short.is_file() and short.samefile(path) else path


def _of_base(layer: Layer, found: str, expected: str) -> ConfigError:
    return ConfigError(layer.file, BASE, found, expected, line_of(layer.text, BASE))


def _over(top: Any, below: Any, tag: str) -> Any:
    if isinstance(top, dict) and isinstance(below, dict):
        if tag in top and top[tag] != below.get(tag):
            return top
        both = {key: _over(top[key], below[key], tag) for key in top if key in below}
        return below | top | both
    if _is_named(top) and _is_named(below):
        return list(_by_name(top, below, tag))
    return top


def _is_named(value: Any) -> bool:
    """Whether it is an array of tables that have names, each its own."""
    if not isinstance(value, list) or not all(isinstance(one, dict) for one in value):
        return False
    names = [str(one.get(NAME, "")) for one in value]
    return "" not in names and len(set(names)) == len(names)


def _by_name(top: list[Any], below: list[Any], tag: str) -> Iterator[Any]:
    own = {one[NAME]: one for one in top}
    for one in below:
        yield _over(own.pop(one[NAME], {}), one, tag)
    yield from own.values()


def _placed(error: ConfigError, layers: Sequence[Layer], raw: dict[str, Any]) -> ConfigError:
    """The error with the file and line that hold its key, the uppermost of several."""
    found = [(layer, *_followed(_steps(error.key), raw, layer.raw)) for layer in layers]
    layer, path, _ = max(found, key=lambda one: one[2])
    key = _written(path)
    line = line_of(layer.text, key) or line_of(layer.text, _written(path[:-1]))
    return ConfigError(layer.file, key, error.found, error.expected, line)


def _followed(steps: _Path, tree: Any, own: Any) -> tuple[_Path, int]:
    """The path `steps` of the whole `tree` in a layer, and how many of its steps exist there."""
    path: _Path = []
    for step in steps:
        place = step if isinstance(step, str) else _own_index(step, tree, own)
        inside = place in own if isinstance(own, dict) else isinstance(own, list) and place != -1
        if not inside:
            break
        path.append(place)
        tree, own = tree[step], own[place]
    return path + steps[len(path) :], len(path)


def _own_index(index: int, tree: list[Any], own: Any) -> int:
    """Where the table `index` of the whole array is in a layer's array; -1 if it is not there."""
    if not isinstance(own, list):
        return -1
    if not (_is_named(tree) and _is_named(own)):
        return index if index < len(own) else -1
    names = [one[NAME] for one in own]
    name = tree[index][NAME]
    return names.index(name) if name in names else -1


def _steps(key: str) -> _Path:
    return [int(index) if index else name for name, index in _STEP.findall(key)]


def _written(path: _Path) -> str:
    text = "".join(f"[{step}]" if isinstance(step, int) else f".{step}" for step in path)
    return text.removeprefix(".")
