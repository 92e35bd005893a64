"""A headless Chromium that is asked through its DevTools pipe: no package, no port, no network."""

from __future__ import annotations

import contextlib
import fcntl
import json
import os
import shutil
import subprocess
import tempfile
from pathlib import Path

FLAGS = (
    *("--headless=new", "--no-sandbox", "--disable-gpu", "--hide-scrollbars", "--no-first-run"),
    *("--disable-background-networking", "--disable-component-update", "--disable-extensions"),
    *("--disable-dev-shm-usage", "--force-color-profile=srgb", "--remote-debugging-pipe"),
)


def find_chromium():
    """Name the browser's program; the tests fail where there is none."""
    for name in ("chromium", "chromium-browser", "google-chrome"):
        found = shutil.which(name)
        if found:
            return found
    raise FileNotFoundError("chromium is missing; .ci/run installs it")


class Chromium:
    """One browser process; ``open`` gives a page."""

    def __init__(self):
        self.home = tempfile.TemporaryDirectory(prefix="bfppc-browser-", ignore_cleanup_errors=True)
        commands, self._commands = os.pipe()
        self._answers, answers = os.pipe()
        # The browser reads descriptor 3 and writes 4, whatever these pipes are called here.
        high = [fcntl.fcntl(each, fcntl.F_DUPFD, 20) for each in (commands, answers)]
        script = f'exec "$@" 3<&{high[0]} 4>&{high[1]} {high[0]}<&- {high[1]}>&-'
        self._process = subprocess.Popen(
            [
                *("bash", "-c", script, "bash", find_chromium(), *FLAGS),
                *(f"--user-data-dir={self.home.name}", "about:blank"),
            ],
            pass_fds=high,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
        )
        for each in (commands, answers, *high):
            os.close(each)
        self._buffer, self._number = b"", 0
        self.events = []

    def close(self):
        """End the browser that this object started."""
        with contextlib.suppress(BrokenPipeError, ConnectionError):
            self.ask("Browser.close")
        os.close(self._commands)
        try:
            self._process.wait(timeout=20)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait()
        os.close(self._answers)
        self.home.cleanup()

    def ask(self, method, session=None, **params):
        """Send one command and wait for its answer; events are kept."""
        self._number += 1
        message = {"id": self._number, "method": method, "params": params}
        if session:
            message["sessionId"] = session
        text = json.dumps(message).encode() + b"\0"
        while text:
            text = text[os.write(self._commands, text) :]
        while True:
            answer = self._read()
            if answer.get("id") == self._number:
                if "error" in answer:
                    raise RuntimeError(f"{method}: {answer['error']}")
                return answer["result"]
            self.events.append(answer)

    def _read(self):
        while b"\0" not in self._buffer:
            received = os.read(self._answers, 1 << 20)
            if not received:
                raise ConnectionError("the browser ended")
            self._buffer += received
        text, _, self._buffer = self._buffer.partition(b"\0")
        return json.loads(text)

    def wait(self, method, session):
        """Wait for an event of a page."""
        while True:
            for index, event in enumerate(self.events):
                if event.get("method") == method and event.get("sessionId") == session:
                    return self.events.pop(index)
            self.events.append(self._read())

    def open(self, path, *, width, height=900, scheme="light", media="screen"):
        """Show a file in a window of this width and colour scheme."""
        target = self.ask("Target.createTarget", url="about:blank")["targetId"]
        session = self.ask("Target.attachToTarget", targetId=target, flatten=True)["sessionId"]
        page = Page(self, target, session)
        for domain in ("Page", "Runtime", "Log", "Network", "DOM", "CSS"):
            page.ask(f"{domain}.enable")
        page.show(width=width, height=height, scheme=scheme, media=media)
        page.ask("Page.navigate", url=Path(path).resolve().as_uri())
        self.wait("Page.loadEventFired", session)
        page.run("document.fonts.ready.then(() => document.fonts.size)")
        return page


class Page:
    """A page that is open; its messages and requests since it was opened."""

    def __init__(self, browser, target, session):
        self._browser, self._target, self._session = browser, target, session

    def ask(self, method, **params):
        return self._browser.ask(method, self._session, **params)

    def show(self, *, width, height=900, scheme="light", media="screen"):
        """Change window and colours of the open page."""
        self.ask(
            "Emulation.setDeviceMetricsOverride",
            width=width,
            height=height,
            deviceScaleFactor=1,
            mobile=width < 600,
        )
        colours = [{"name": "prefers-color-scheme", "value": scheme}]
        self.ask("Emulation.setEmulatedMedia", media=media, features=colours)

    def run(self, script):
        """Give the value of a script; a promise is waited for."""
        found = self.ask(
            "Runtime.evaluate", expression=script, awaitPromise=True, returnByValue=True
        )
        if "exceptionDetails" in found:
            raise RuntimeError(str(found["exceptionDetails"]))
        return found["result"].get("value")

    def messages(self):
        """List what the page logged: console, exceptions, refused content."""
        kinds = {"Runtime.consoleAPICalled", "Runtime.exceptionThrown", "Log.entryAdded"}
        return [event["params"] for event in self._mine() if event["method"] in kinds]

    def requests(self):
        """List the addresses that the page asked for."""
        return [
            event["params"]["request"]["url"]
            for event in self._mine()
            if event["method"] == "Network.requestWillBeSent"
        ]

    def _mine(self):
        return [event for event in self._browser.events if event.get("sessionId") == self._session]

    def close(self):
        self._browser.events = [
            event for event in self._browser.events if event.get("sessionId") != self._session
        ]
        self._browser.ask("Target.closeTarget", targetId=self._target)
