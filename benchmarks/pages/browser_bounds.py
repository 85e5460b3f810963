"""What strangers and crowds do to the server: it refuses or bounds it, and goes on answering."""

import http.client
import shutil
import tempfile
import threading
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import psutil

from tools.benchmark_table import Row

CLIENTS, EACH = 50, 20
GIGABYTE = 1 << 30


def run(quick: bool) -> list[Row]:
    """The rows of this benchmark."""
    from tests.browser.page import Served

    root = Path(tempfile.mkdtemp(prefix="rigwatch-bounds-"))
    served = Served(root)
    try:
        return [_crowd(served), _upload(served, GIGABYTE // 10 if quick else GIGABYTE)]
    finally:
        served.end()
        shutil.rmtree(root, ignore_errors=True)


def _ask(served: Any, path: str, method: str = "GET", body: Any = None, **more: str) -> int:
    line = http.client.HTTPConnection(served.address.removeprefix("http://"), timeout=3600)
    head = {"Authorization": served.bearer, "Origin": served.address} | more
    try:
        line.request(method, path, body, {k.replace("_", "-"): v for k, v in head.items()})
        answer = line.getresponse()
        answer.read()
        return int(answer.status)
    finally:
        line.close()


def _crowd(served: Any) -> Row:
    found: list[tuple[int, float]] = []

    def client() -> None:
        for _ in range(EACH):
            begun = time.perf_counter()
            status = _ask(served, "/new")
            found.append((status, time.perf_counter() - begun))

    clients = [threading.Thread(target=client) for _ in range(CLIENTS)]
    for one in clients:
        one.start()
    for one in clients:
        one.join()
    good = sum(status == 200 for status, _ in found)
    p95 = float(np.quantile([took for _, took in found], 0.95))
    return Row(
        f"{CLIENTS} clients at once, pages answered", f"{good} of {CLIENTS * EACH}",
        f"{CLIENTS * EACH}", "", f"p95 {1e3 * p95:.0f} ms", good == CLIENTS * EACH,
    )  # fmt: skip


def _upload(served: Any, size: int) -> Row:
    """A text file of a gigabyte, and what other clients notice of it."""
    server, ended = psutil.Process(served.process.pid), threading.Event()
    memory, waits = [float(server.memory_info().rss)], []

    def other() -> None:
        while not ended.wait(0.2):
            begun = time.perf_counter()
            assert _ask(served, "/") == 200
            waits.append(time.perf_counter() - begun)
            memory.append(float(server.memory_info().rss))

    watch = threading.Thread(target=other)
    watch.start()
    status = _ask(served, "/api/upload/big.csv", "PUT", _table(size), Content_Length=str(size))
    over = _ask(served, "/api/upload/more.csv", "PUT", Content_Length=str(GIGABYTE + 1))
    ended.set()
    watch.join()
    grown, p95 = (max(memory) - memory[0]) / 1e6, float(np.quantile(waits, 0.95))
    return Row(
        f"upload of {size >> 20} MB of text: server's memory grows; a page takes, p95",
        f"{grown:.0f} MB; {1e3 * p95:.0f} ms", "100 MB; 200 ms", "",
        f"answered {status}, one byte more {over}; read in a process of its own, with at most half"
        " of the machine's memory", status in (200, 409) and over == 413
        and grown < 100 and p95 < 0.2,
    )  # fmt: skip


def _table(size: int) -> Iterator[bytes]:
    row = b"".join(b"%d.0,%.6f,%.6f,%.6f\n" % (k, k / 1e3, k / 5e2, k / 2e3) for k in range(30_000))
    left = size
    for part in (b"t,a,b,c\n", *[row] * (size // len(row) + 1)):
        yield part[:left]
        left = max(left - len(part), 0)
