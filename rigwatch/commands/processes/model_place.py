"""Where `rigwatch commission` writes its model: checked before and after, the former one kept."""

import os
import time
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from monitor.model import RigModel


def check_place(path: Path) -> None:
    """Refuse a place that cannot be written, before minutes of work.

    Raises:
        ModelError: there is no such folder, or the path is one.
    """
    from rigwatch.wire.errors import ModelError

    folder = path.absolute().parent
    if not folder.is_dir() or path.is_dir():
        found = "a folder" if path.is_dir() else f"no folder {folder}"
        raise ModelError(f"{path}: found {found}, expected a file to write")


def install_model(path: Path, model: "RigModel") -> str:
    """Write a model whose text reads back the same; returns the file of the one before, or "".

    Raises:
        ConfigError: it cannot be written, or its text is no model.
        ModelError: the text holds another model.
    """
    from monitor.model import model_text, model_versions, parse_model
    from rigwatch.wire.errors import ModelError

    text = model_text(model)
    if parse_model(text, f"{path} as it would be written") != model:
        raise ModelError(f"{path}: found another model in its text, expected the commissioned one")
    is_first = not path.exists()
    names = ", ".join(one.name for one in model.recording)
    author = model_versions.Author(
        os.environ.get("USER") or f"uid {os.getuid()}", f"commissioned from {names}"
    )
    model_versions.install(path, text, time.time_ns(), author, "commission")
    return "" if is_first else model_versions.newest_before(path).name
