"""Recordings of one process begin a few at a time; those that hang hold nobody up for long."""

import threading
import time

from rigwatch.recorder import several
from rigwatch.recorder.several import BEGIN_TOGETHER, Begins
from tests.waiting import eventually


def test_few_begin_at_a_time_and_all_do() -> None:
    begins, lock = Begins(), threading.Lock()
    now, most, begun = 0, 0, 0

    def begin() -> None:
        nonlocal now, most, begun
        with begins.one():
            with lock:
                now += 1
                most = max(most, now)
            time.sleep(0.01)
            with lock:
                now, begun = now - 1, begun + 1

    threads = [threading.Thread(target=begin) for _ in range(20)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert (most, begun) == (BEGIN_TOGETHER, 20)


def test_those_that_hang_hold_nobody_up_for_long(monkeypatch) -> None:
    monkeypatch.setattr(several, "BEGIN_PATIENCE", 0.1)
    begins, held = Begins(), threading.Event()
    hang, go_on = threading.Semaphore(0), threading.Semaphore(0)

    def begin_and_hang() -> None:
        with begins.one():
            hang.release()
            held.wait()

    def begin() -> None:
        with begins.one():
            go_on.release()

    for _ in range(BEGIN_TOGETHER):
        threading.Thread(target=begin_and_hang).start()
    for _ in range(BEGIN_TOGETHER):
        assert hang.acquire(timeout=10.0)
    waiting = [threading.Thread(target=begin) for _ in range(10)]
    for thread in waiting:
        thread.start()
    for _ in waiting:
        assert go_on.acquire(timeout=10.0)
    held.set()
    eventually(lambda: not any(thread.is_alive() for thread in waiting), "all have begun")
