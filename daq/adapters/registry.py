"""Finds adapters: those shipped with rigwatch and those that other packages register.

Adapters are entry points in the group `rigwatch.adapters`; the built-in ones are registered there
like any other. An entry point names a callable `factory(section, channels) -> Adapter`.
"""

from collections.abc import Callable
from importlib.metadata import EntryPoint, entry_points
from typing import Any

from daq.adapter import Adapter
from rigwatch.wire.errors import DeviceError
from rigwatch.wire.rig_config import ChannelSection, DeviceSection, PluginSection

GROUP = "rigwatch.adapters"
Factory = Callable[[Any, tuple[ChannelSection, ...]], Adapter]


def adapter_for(section: DeviceSection, channels: tuple[ChannelSection, ...]) -> Adapter:
    """The adapter that `section` names, not opened yet.

    Raises:
        DeviceError: no adapter has that name, or it cannot be loaded.
    """
    name = section.name if isinstance(section, PluginSection) else _tag(section)
    options = section.options if isinstance(section, PluginSection) else section
    return _factory(name)(options, channels)


def known() -> dict[str, EntryPoint]:
    """Every installed adapter, by name."""
    return {point.name: point for point in entry_points(group=GROUP)}


def _tag(section: DeviceSection) -> str:
    return str(section.__struct_config__.tag)


def _factory(name: str) -> Factory:
    points = known()
    if name not in points:
        raise DeviceError(f"adapter {name!r} is not installed; found {', '.join(sorted(points))}")
    try:
        factory: Factory = points[name].load()
    except Exception as error:
        raise DeviceError(f"adapter {name!r} ({points[name].value}): {error}") from error
    return factory
