"""Applies model-change requests while the monitor runs, between two samples."""

import queue
import threading
from dataclasses import dataclass, field, replace
from pathlib import Path

import msgspec
from msgspec import structs

from monitor.model import RigModel, model_text, parse_model
from monitor.model import model_versions as versions
from monitor.pipeline import RigMonitor, check_can_follow
from rigwatch.wire.bus import (
    KEY,
    LARGEST_NUMBERED,
    PATIENCE,
    Bus,
    CommandCheck,
    ModelReply,
    ModelRequest,
)
from rigwatch.wire.errors import ModelError, RigwatchError
from rigwatch.wire.messages import LONGEST_NAME, LONGEST_TEXT, Identity, ModelChange, encode
from rigwatch.wire.typed_files import JsonError, json_value
from rigwatch.wire.wiring_names import WIRING

BEGUN_WITHIN = 2.4
"""Time after which a change that has not begun is withdrawn [s]."""


@dataclass(eq=False)
class _Waiting:
    """A request whose sender waits for the answer."""

    request: ModelRequest
    identity: Identity
    decided: threading.Lock = field(default_factory=threading.Lock)
    answered: threading.Event = field(default_factory=threading.Event)
    answer: ModelReply = field(
        default_factory=lambda: ModelReply(
            False, "it has begun and may still come into force: its file is written slowly"
        )
    )

    def decide(self) -> bool:
        """Apply or withdraw it: whoever comes first may, and only once."""
        return self.decided.acquire(blocking=False)


@dataclass(frozen=True, slots=True)
class Place:
    """Position in the stream of samples: the next sample and its earliest time."""

    device: str
    boot: int
    seq: int
    t_ns: int


class ModelDesk:
    """Receives and applies the model-change requests of one monitor.

    Args:
        bus: source of requests.
        rig: the pipeline that uses the model.
        path: the model file.
        check: verifies who makes a request.
    """

    def __init__(self, bus: Bus, rig: RigMonitor, path: Path, check: CommandCheck) -> None:
        self._rig, self._path, self._check = rig, path, check
        self._waiting: queue.SimpleQueue[_Waiting] = queue.SimpleQueue()
        self._close = bus.serve(KEY, self._take)

    @property
    def has_some(self) -> bool:
        """Whether requests wait."""
        return not self._waiting.empty()

    def changes(self, place: Place) -> list[ModelChange]:
        """Apply waiting requests in the monitor's own thread; return the messages to publish."""
        found = []
        while not self._waiting.empty():
            one = self._waiting.get()
            if not one.decide():
                continue  # withdrawn
            try:
                found.append(self._apply(one.request, one.identity, place))
                text = f"in force from sample {place.seq} of boot {place.boot} on"
                one.answer = ModelReply(True, text, place.boot, place.seq)
            except RigwatchError as error:
                one.answer = ModelReply(False, str(error))
            except (OSError, ValueError, ArithmeticError, RecursionError, MemoryError) as error:
                # An unusable model must not stop the monitor.
                one.answer = ModelReply(False, f"the new model cannot be used: {error}")
            one.answered.set()
        return found

    def close(self) -> None:
        """Accept no more requests."""
        self._close()

    def _take(self, question: bytes) -> list[bytes]:
        """In a thread of the bus: queue the request and wait."""
        try:
            request = json_value(question, ModelRequest)
        except JsonError as error:
            self._check.refuse()
            return [msgspec.json.encode(ModelReply(False, f"not a model request: {error}"))]
        verdict = self._check.judge(request)
        if verdict.refusal:
            return [msgspec.json.encode(ModelReply(False, f"refused: {verdict.refusal}"))]
        one = _Waiting(_bounded(request), verdict.identity)
        self._waiting.put(one)
        if not one.answered.wait(BEGUN_WITHIN) and one.decide():
            return [msgspec.json.encode(ModelReply(False, "the monitor is busy; nothing changes"))]
        one.answered.wait(0.8 * PATIENCE - BEGUN_WITHIN)  # begun: a slow disk is waited for
        return [msgspec.json.encode(one.answer)]

    def _apply(self, request: ModelRequest, identity: Identity, place: Place) -> ModelChange:
        """Apply one request; the file is written first, so the model survives a restart."""
        model = self._requested_model(request)
        check_can_follow(self._rig.model, model)
        change = self._change(request, identity, place, model)
        author = versions.Author(request.user, request.text, identity)
        if request.action == "rollback":
            versions.roll_back(self._path, place.t_ns, author)
        else:
            step = request.action
            versions.install(self._path, _text(request, model), place.t_ns, author, step)
        self._rig.adopt(model)
        return change

    def _change(
        self, request: ModelRequest, identity: Identity, place: Place, model: RigModel
    ) -> ModelChange:
        """The message about it, without the previous model where it has no room for both.

        Raises:
            ModelError: it has none for the new one either; a recording would not know of it.
        """
        change = ModelChange(
            place.device,
            place.boot,
            place.seq,
            place.t_ns,
            request.user,
            request.text or request.action,
            model_text(model),
            model_text(self._rig.model),
            identity,
        )
        change = change if _fits(change) else replace(change, previous="")
        if not _fits(change):
            size = f"{len(change.model)} characters, more than can be told"
            raise ModelError(f"the model has {size}: commission it with shorter or fewer periods")
        return change

    def _requested_model(self, request: ModelRequest) -> RigModel:
        if request.action == "rollback":
            return parse_model(versions.version_before(self._path), str(self._path))
        if request.action == "accept":
            return self._accepting(request.model)
        return parse_model(request.model, "the new model")

    def _accepting(self, name: str) -> RigModel:
        """The present model with the person's word for the wiring that fails.

        Raises:
            ModelError: no alarm of the wiring stands by this name.
        """
        if name not in WIRING or not self._rig.alarms.holds(name):
            raise ModelError(
                f"found no alarm {name!r} of the wiring whose condition holds, expected one of "
                f"{', '.join(WIRING)} that does"
            )
        known = dict.fromkeys((*self._rig.model.accepted_wiring, name))
        return structs.replace(self._rig.model, accepted_wiring=tuple(known))


def _text(request: ModelRequest, model: RigModel) -> str:
    """The model file's text; a promoted one is kept as it came."""
    return request.model if request.action == "promote" else model_text(model)


def _fits(change: ModelChange) -> bool:
    return len(encode(change)) <= LARGEST_NUMBERED


def _bounded(request: ModelRequest) -> ModelRequest:
    """The request with user and reason limited in length for the version records."""
    return replace(request, user=request.user[:LONGEST_NAME], text=request.text[:LONGEST_TEXT])
