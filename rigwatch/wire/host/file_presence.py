"""Whether a file is there, as far as can be told."""

import stat
from pathlib import Path


def may_be_file(path: Path) -> bool:
    """Whether there is such a file; also while nobody can tell, as on a share that is away."""
    try:
        return stat.S_ISREG(path.stat().st_mode)
    except (FileNotFoundError, NotADirectoryError):
        return False
    except OSError:
        return True
