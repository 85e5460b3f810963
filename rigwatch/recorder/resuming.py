"""Where a recording continues after a change of the configuration.

It continues after the last messages of those senders that are still running. Senders that have gone
since, such as an earlier boot of the device, belong to the previous session alone.
"""

from dataclasses import replace

from rigwatch.recorder.folders import Place
from rigwatch.wire.bus import SAID_KEY, Bus
from rigwatch.wire.delivery import SOURCE_KEY


def of_living(bus: Bus, place: Place) -> Place:
    """The place with the positions of senders that are still running only."""
    boots, runs = _numbers(bus, SOURCE_KEY), _numbers(bus, f"{SAID_KEY}/*")
    positions = {
        topic: {process: at for process, at in said.items() if str(at[0]) in runs}
        for topic, said in place.positions.items()
    }
    last = place.last if place.last and str(place.last[0]) in boots else None
    return replace(place, last=last, positions=positions)


def _numbers(bus: Bus, places: str) -> set[str]:
    """The boots or runs named by the liveliness tokens at these keys."""
    return {name.partition("/")[0] for _, name in bus.names(places) if name}
