"""A real Chromium, headless, driven over the WebDriver protocol with the standard library alone."""

import contextlib
import json
import shutil
import subprocess
import time
import urllib.error
import urllib.request
from pathlib import Path
from typing import Any

import pytest
from patience import crowded

_ARGUMENTS = (
    "--headless=new",
    "--no-sandbox",
    "--disable-gpu",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
    "--no-first-run",
    "--disable-dev-shm-usage",
)
KEYS = {
    "Tab": "\ue004",
    "Enter": "\ue007",
    "Escape": "\ue00c",
    "ArrowRight": "\ue014",
    "ArrowLeft": "\ue012",
    "ArrowDown": "\ue015",
}


def _program(*names: str) -> str:
    for name in names:
        found = shutil.which(name)
        if found is not None:
            return found
    wanted = " or ".join(names)
    raise RuntimeError(
        f"{wanted} is not installed; on Debian: apt-get install chromium chromium-driver"
    )


needed = pytest.mark.skipif(
    shutil.which("chromedriver") is None,
    reason="no Chromium here; on Debian: apt-get install chromium chromium-driver",
)
"""For a test of the short profile, which asks for nothing but Python; the full profile's fail without a browser."""


class Browser:
    """One session; use it as a context."""

    def __init__(self) -> None:
        binary = _program("chromium", "chromium-browser", "google-chrome")
        self._driver = subprocess.Popen(
            [_program("chromedriver"), "--port=0"],
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
            text=True,
        )
        self._base = f"http://127.0.0.1:{self._port()}"
        options = {"args": list(_ARGUMENTS), "binary": binary}
        wanted = {"goog:chromeOptions": options, "goog:loggingPrefs": {"browser": "ALL"}}
        wanted |= {"timeouts": {"script": int(1e3 * crowded(100))}}
        made = self._ask("POST", "/session", {"capabilities": {"alwaysMatch": wanted}})
        self._base += f"/session/{made['sessionId']}"

    def _port(self) -> int:
        assert self._driver.stdout is not None
        for line in self._driver.stdout:
            if "started successfully on port" in line:
                return int(line.rstrip(".\n").rpartition(" ")[2])
        raise RuntimeError("chromedriver ended before it said on which port it listens")

    def _ask(self, method: str, path: str, body: dict[str, Any] | None = None) -> Any:
        data = None if body is None else json.dumps(body).encode()
        request = urllib.request.Request(self._base + path, data, method=method)
        try:
            with urllib.request.urlopen(request, timeout=crowded(120)) as answer:
                return json.load(answer)["value"]
        except urllib.error.HTTPError as error:
            raise RuntimeError(json.load(error)["value"]["message"]) from None

    def command(self, name: str, **parameters: Any) -> Any:
        """A command of the DevTools protocol."""
        return self._ask("POST", "/goog/cdp/execute", {"cmd": name, "params": parameters})

    def open(self, page: Path, width: int, scheme: str = "light") -> None:
        """Load a page at a width, in the light or the dark scheme, without motion."""
        self.command(
            "Emulation.setDeviceMetricsOverride",
            width=width,
            height=900,
            deviceScaleFactor=1,
            mobile=False,
        )
        features = {"prefers-color-scheme": scheme, "prefers-reduced-motion": "reduce"}
        self.command(
            "Emulation.setEmulatedMedia",
            features=[{"name": k, "value": v} for k, v in features.items()],
        )
        self._ask("POST", "/url", {"url": page.resolve().as_uri()})

    def run(self, script: str) -> Any:
        """The value that a script returns."""
        return self._ask("POST", "/execute/sync", {"script": script, "args": []})

    def press(self, *names: str) -> None:
        """Press keys one after the other, wherever the focus is."""
        steps = []
        for name in names:
            key = KEYS.get(name, name)
            steps += [{"type": "keyDown", "value": key}, {"type": "keyUp", "value": key}]
        self._ask(
            "POST", "/actions", {"actions": [{"type": "key", "id": "keys", "actions": steps}]}
        )

    def point(self, selector: str, press: bool) -> None:
        """Move the pointer to the middle of an element, and click there if asked."""
        where = self.run(
            f"const e = document.querySelector({json.dumps(selector)}); e.scrollIntoView({{block: 'center', "
            "behavior: 'instant'}); const b = e.getBoundingClientRect();"
            "return [b.x + b.width / 2, b.y + b.height / 2].map(Math.round);"
        )
        steps: list[dict[str, Any]] = [
            {"type": "pointerMove", "duration": 0, "x": where[0], "y": where[1]}
        ]
        if press:
            steps += [{"type": "pointerDown", "button": 0}, {"type": "pointerUp", "button": 0}]
        mouse = {
            "type": "pointer",
            "id": "mouse",
            "parameters": {"pointerType": "mouse"},
            "actions": steps,
        }
        self._ask("POST", "/actions", {"actions": [mouse]})

    def log(self) -> list[str]:
        """What the console got since the last call."""
        return [entry["message"] for entry in self._ask("POST", "/se/log", {"type": "browser"})]

    def wait(self, condition: str, seconds: float = 20.0) -> None:
        """Until a script's condition is true."""
        end = time.monotonic() + crowded(seconds)
        while not self.run(f"return Boolean({condition});"):
            if time.monotonic() > end:
                raise AssertionError(f"never true: {condition}")
            time.sleep(0.05)

    def close(self) -> None:
        """End the session and the driver."""
        try:
            self._ask("DELETE", "")
        finally:
            self._driver.terminate()
            with contextlib.suppress(subprocess.TimeoutExpired):
                self._driver.wait(10)
            self._driver.kill()  # its session has ended; some drivers do not hear the first signal
            self._driver.wait(crowded(20))
            assert self._driver.stdout is not None
            self._driver.stdout.close()
