"""Messages as JSON values, for pages, scripts and people's programs."""

import math
from dataclasses import asdict
from typing import Any

from rigwatch.wire.messages.message_types import Alarm


def json_fields(alarm: Alarm) -> dict[str, Any]:
    """An alarm's fields; None for a figure that does not exist, as JSON has no such number."""
    return {
        name: None if isinstance(value, float) and not math.isfinite(value) else value
        for name, value in asdict(alarm).items()
    }
