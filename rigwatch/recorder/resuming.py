"""Where a recording with a changed configuration goes on: after those senders that are still there.

A session of another configuration is another recording: it has no part in what ended with the one
before, such as an earlier start of the device.
"""

from dataclasses import replace

from rigwatch.recorder.folders import Place
from rigwatch.wire.bus import SAID_KEY, Bus
from rigwatch.wire.delivery import SOURCE_KEY


def of_living(bus: Bus, place: Place) -> Place:
    """The place without the samples and messages of senders that are gone."""
    boots, runs = _numbers(bus, SOURCE_KEY), _numbers(bus, f"{SAID_KEY}/*")
    positions = {
        topic: {process: at for process, at in said.items() if str(at[0]) in runs}
        for topic, said in place.positions.items()
    }
    last = place.last if place.last and str(place.last[0]) in boots else None
    return replace(place, last=last, positions=positions)


def _numbers(bus: Bus, places: str) -> set[str]:
    """The boots or runs that tokens name."""
    return {name.partition("/")[0] for _, name in bus.names(places) if name}
