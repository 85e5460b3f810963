"""An argument that is a file, or the name of one shipped with rigwatch."""

import argparse
from collections.abc import Callable
from pathlib import Path


def file_or_name(kind: str) -> Callable[[str], Path]:
    """The argparse type of such an argument; `kind` is a folder of `configs`."""

    def found(given: str) -> Path:
        from rigwatch.wire.errors import ConfigError
        from rigwatch.wire.typed_files import find_file

        try:
            return find_file(given, kind)
        except ConfigError as error:
            raise argparse.ArgumentTypeError(str(error)) from None

    return found
