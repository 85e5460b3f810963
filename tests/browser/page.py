"""A person at the workbench's pages: a real headless Chromium, driven by mouse and by keyboard."""

import os
import shutil
import signal
import subprocess
import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

import msgspec
import pytest
from selenium import webdriver
from selenium.common.exceptions import StaleElementReferenceException
from selenium.webdriver.chrome.service import Service
from selenium.webdriver.common.action_chains import ActionChains
from selenium.webdriver.common.by import By
from selenium.webdriver.remote.webelement import WebElement

from tests.waiting import eventually

AXE = (Path(__file__).parent / "vendor" / "axe.min.js").read_text(encoding="utf-8")
CHROMIUM, DRIVER = shutil.which("chromium"), shutil.which("chromedriver")
SIZE = "1440,1000"
ROOT = Path(__file__).parents[2]


class Served:
    """`rigwatch workbench` as a process of its own.

    Attributes:
        folder: that is served.
        address, token: of its pages.
        bearer: the token in the header `Authorization`, for clients that are no browser.
    """

    def __init__(
        self,
        folder: Path,
        *arguments: str,
        cwd: Path | None = None,
        command: tuple[str, ...] | None = None,
    ) -> None:
        self.folder = folder
        words = command or ("workbench", str(folder))
        self.process = subprocess.Popen(
            [sys.executable, "-m", "rigwatch", *words, "--json", *arguments],
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            env=os.environ | {"OPENBLAS_NUM_THREADS": "1", "PYTHONPATH": str(ROOT)},
            cwd=cwd,
        )
        self.said: list[str] = []
        assert self.process.stdout is not None
        first = self.process.stdout.readline()
        assert first, self.process.stderr.read() if self.process.stderr else ""
        self.whole = msgspec.json.decode(first)["address"]
        split = urlsplit(self.whole)
        self.address, self.token = f"{split.scheme}://{split.netloc}", split.query[len("token=") :]
        self.bearer = f"Bearer {self.token}"
        threading.Thread(target=self._listen, daemon=True).start()

    def _listen(self) -> None:
        assert self.process.stderr is not None
        for line in self.process.stderr:
            self.said.append(line.decode())

    def end(self) -> None:
        """End it as Ctrl-C does."""
        self.process.send_signal(signal.SIGINT)
        try:
            self.process.wait(30)
        except subprocess.TimeoutExpired:
            self.process.kill()
            self.process.wait()


@contextmanager
def browser() -> Iterator[webdriver.Chrome]:
    """A headless Chromium; without Debian's packages the test is skipped, but not in CI."""
    if not (CHROMIUM and DRIVER):
        assert os.environ.get("CI") != "true", "no chromium: install chromium and chromium-driver"
        pytest.skip("no chromium with its driver here")
    options = webdriver.ChromeOptions()
    options.binary_location = CHROMIUM
    for argument in ("headless=new", "no-sandbox", "disable-gpu", f"window-size={SIZE}",
                     "disable-dev-shm-usage", "force-device-scale-factor=1"):  # fmt: skip
        options.add_argument(f"--{argument}")
    options.set_capability("goog:loggingPrefs", {"browser": "ALL", "performance": "ALL"})
    driver = webdriver.Chrome(options=options, service=Service(DRIVER))
    try:
        yield driver
    finally:
        driver.quit()


class Page:
    """What a person sees and does.

    Args:
        driver: the browser.
        served: the server.
    """

    def __init__(self, driver: webdriver.Chrome, served: Served) -> None:
        self.driver, self.served = driver, served

    def open(self, path: str) -> None:
        """Open a page and wait until its code runs."""
        self.driver.get(self.served.address + path)

    def enter(self) -> None:
        """Come in with the printed address."""
        self.driver.get(self.served.whole)

    def run(self, script: str, *arguments: object) -> Any:
        """What a script of the page returns."""
        return self.driver.execute_script(script, *arguments)

    def find(self, css: str) -> WebElement:
        """The element, once it is there."""
        self.until(lambda: bool(self.all(css)), css)
        return self.all(css)[0]

    def all(self, css: str) -> list[WebElement]:
        """Every such element."""
        return self.driver.find_elements(By.CSS_SELECTOR, css)

    def text(self, css: str) -> str:
        """What an element says, empty where it is not there."""
        return str(self.run("return document.querySelector(arguments[0])?.textContent ?? ''", css))

    def data(self, css: str, name: str = "value") -> str | None:
        """A datum of an element."""
        found: str | None = self.run(
            "return document.querySelector(arguments[0])?.dataset[arguments[1]]", css, name
        )
        return found

    def click(self, css: str) -> None:
        """Press the mouse on it, where it is."""
        self.until(lambda: self._clicked(css), f"click on {css}")

    def _clicked(self, css: str) -> bool:
        """Whether it was there, whole, and pressed."""
        try:
            element = self.all(css)[0]
            self.run("arguments[0].scrollIntoView({block: 'nearest'})", element)
            ActionChains(self.driver, duration=20).move_to_element(element).click().perform()
        except (StaleElementReferenceException, IndexError):
            return False
        return True

    def press(self, *keys: str) -> None:
        """Type keys into whatever has the focus."""
        ActionChains(self.driver, duration=0).send_keys(*keys).perform()

    def until(self, holds: Callable[[], object], what: str) -> None:
        """Wait for a condition; a part of the page that is replaced meanwhile is no error."""

        def safely() -> bool:
            assert "Internal Server Error" not in self.text("#toast"), "".join(self.served.said)
            try:
                return bool(holds())
            except StaleElementReferenceException:
                return False

        eventually(safely, f"{what}; the page shows {self.driver.title}, {self.text('#toast')!r}")

    def after(self, act: Callable[[], None], task: str, state: str) -> None:
        """Do something that begins a task, and wait for its end."""
        self.run("delete document.body.dataset.ended")
        act()

        def ended() -> bool:
            told = str(self.run("return document.body.dataset.ended ?? ''"))
            as_wanted = f"{task} {state};" in told
            assert as_wanted or " failed" not in told, (told, self.text("#toast"))
            return as_wanted

        self.until(ended, f"{task} is {state}")

    def errors(self) -> list[str]:
        """Errors of the console since the last call, but for pages that do not exist."""
        found = (entry["message"] for entry in self.driver.get_log("browser"))
        return [message for message in found if not _is_missing_page(message)]

    def requests(self) -> set[str]:
        """Where the page asked for something since it was last asked."""
        found = set()
        for entry in self.driver.get_log("performance"):
            message = msgspec.json.decode(entry["message"])["message"]
            if message["method"] == "Network.requestWillBeSent":
                split = urlsplit(message["params"]["request"]["url"])
                if split.scheme in ("http", "https", "ws", "wss"):
                    found.add(f"{split.scheme}://{split.netloc}")
        return found

    def forget(self) -> None:
        """Empty the browser's logs: what a failed test left there is not the next one's."""
        self.errors()
        self.requests()

    def violations(self, *, dark: bool) -> list[str]:
        """What axe finds, in a light page or in a dark one."""
        scheme = {"name": "prefers-color-scheme", "value": "dark" if dark else "light"}
        self.driver.execute_cdp_cmd("Emulation.setEmulatedMedia", {"features": [scheme]})
        if not self.run("return Boolean(window.axe)"):
            self.driver.execute_cdp_cmd("Runtime.evaluate", {"expression": AXE})
        found = self.driver.execute_async_script(
            "const done = arguments[arguments.length - 1];"
            "axe.run(document, {resultTypes: ['violations'], runOnly: ['wcag2a', 'wcag2aa',"
            " 'wcag21a', 'wcag21aa', 'wcag22aa']})"
            ".then((found) => done(found.violations),"
            " (error) => done([{id: String(error), nodes: []}]))"
        )
        return [
            f"{one['id']}: {node['html'][:140]} {node.get('failureSummary', '')[:200]}"
            for one in found
            for node in one["nodes"] or [{"html": ""}]
        ]

    def pictured(self, name: str) -> None:
        """Take the documents' picture, light, where a folder for it is given."""
        if folder := os.environ.get("RIGWATCH_PICTURES"):
            self.driver.execute_cdp_cmd("Emulation.setEmulatedMedia", {"features": [
                {"name": "prefers-color-scheme", "value": "light"}]})  # fmt: skip
            self.picture(Path(folder) / name)

    def picture(self, path: Path) -> None:
        """What is seen, as PNG."""
        self.driver.save_screenshot(str(path))


def _is_missing_page(message: str) -> bool:
    """Whether a console error only tells that a page, not a part of one, was answered with 404."""
    address, _, text = message.partition(" - ")
    missing = "status of 404" in text
    return missing and not urlsplit(address).path.startswith(("/static", "/api"))


@contextmanager
def serving(folder: Path, *arguments: str, cwd: Path | None = None) -> Iterator[Served]:
    """A server that ends with the test, and says no traceback until then."""
    served = Served(folder, *arguments, cwd=cwd)
    try:
        yield served
    finally:
        served.end()
    assert not [line for line in served.said if "Traceback" in line], "".join(served.said)


@contextmanager
def looking(driver: webdriver.Chrome, served: Served) -> Iterator[Page]:
    """The browser at a server: in the end no page has failed or asked for anything elsewhere."""
    page = Page(driver, served)
    driver.get("about:blank")  # an earlier page may still ask its own server
    page.forget()
    page.enter()
    try:
        yield page
        assert page.errors() == []
        assert page.requests() <= {served.address}
    finally:
        driver.get("about:blank")  # a page that stays open calls its server, also one that ended
        page.forget()
