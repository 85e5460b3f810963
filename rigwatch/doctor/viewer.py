"""Checks of how the dashboard can be displayed."""

import importlib.util
import os
from collections.abc import Iterator
from pathlib import Path

from rigwatch.dashboard import viewer_program
from rigwatch.doctor.finding import Finding, judged


def check_viewer() -> Iterator[Finding]:
    """The viewer, a display for its window, and a driver if there is none."""
    if importlib.util.find_spec("rerun") is None:
        remedy = "pip install 'rigwatch[dashboard]'"
        yield Finding("viewer", "warn", "rerun is not installed: no dashboard", remedy)
        return
    program = viewer_program()
    remedy = "pip install --force-reinstall rerun-sdk"
    yield judged("viewer", program is not None, f"rerun: {program or 'no program'}", remedy, "warn")
    yield check_display()
    yield check_vulkan()


def check_display() -> Finding:
    """A window can be opened here; if not, the web viewer does the same."""
    display = os.environ.get("WAYLAND_DISPLAY") or os.environ.get("DISPLAY")
    text = f"display {display}" if display else "no display: the web viewer is served on loopback"
    return Finding("display", "ok", text)


def check_vulkan() -> Finding:
    """A graphics driver exists; only the native viewer and its test need it."""
    folders = (Path("/usr/share/vulkan/icd.d"), Path("/etc/vulkan/icd.d"))
    drivers = [driver.stem for folder in folders for driver in folder.glob("*.json")]
    text = f"{len(drivers)} drivers" if drivers else "no driver: no native viewer, no viewer test"
    remedy = "apt-get install mesa-vulkan-drivers libvulkan1"
    return judged("vulkan", bool(drivers), text, remedy, "warn")
