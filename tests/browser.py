# SPDX-License-Identifier: BSD-3-Clause
"""Drives a headless Chromium over its debugging pipe, with what Python has."""
import base64
import json
import os
import pathlib
import select
import shutil
import subprocess
import tempfile
import time


def find():
    """Path of the browser; None: there is none."""
    return shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")


class Browser:
    """One page of a browser of its own. errors: what its console and its loader complained about."""

    def __init__(self, width=1280, height=800, scale=1.0, is_phone=False):
        self.errors = []
        self.number = 0
        self.rest = b""
        self.folder = tempfile.TemporaryDirectory(prefix="roslam_browser_", ignore_cleanup_errors=True)
        to_child, self.out = os.pipe()
        self.source, from_child = os.pipe()

        def prepare():
            os.dup2(os.dup(to_child), 20)  # out of the way of 3 and 4
            os.dup2(os.dup(from_child), 21)
            os.dup2(20, 3)
            os.dup2(21, 4)

        self.process = subprocess.Popen(
            [find(), "--headless=new", "--remote-debugging-pipe", f"--user-data-dir={self.folder.name}",
             "--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--no-sandbox", "--hide-scrollbars",
             "--no-first-run", "--disable-extensions", "--disable-background-networking", "about:blank"],
            close_fds=False, preexec_fn=prepare, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        os.close(to_child)
        os.close(from_child)
        self.session = None
        target = self.call("Target.createTarget", url="about:blank")["targetId"]
        self.session = self.call("Target.attachToTarget", targetId=target, flatten=True)["sessionId"]
        for domain in ("Page", "Runtime", "Log", "Network"):
            self.call(domain + ".enable")
        self.call("Emulation.setDeviceMetricsOverride", width=width, height=height, deviceScaleFactor=scale,
                  mobile=is_phone)
        if is_phone:
            self.call("Emulation.setTouchEmulationEnabled", enabled=True)

    def call(self, method, **parameters):
        self.number += 1
        message = {"id": self.number, "method": method, "params": parameters}
        if self.session:
            message["sessionId"] = self.session
        os.write(self.out, json.dumps(message).encode() + b"\0")
        deadline = time.monotonic() + 60
        while True:
            reply = self.read(deadline)
            if reply is None:
                raise TimeoutError(f"{method}: no answer")
            if reply.get("id") == self.number:
                if "error" in reply:
                    raise RuntimeError(f"{method}: {reply['error']}")
                return reply["result"]

    def read(self, deadline):
        """The next message that is not an event; events are looked at on the way. None: the time is over."""
        while True:
            while b"\0" not in self.rest:
                left = deadline - time.monotonic()
                if left <= 0 or not select.select([self.source], [], [], left)[0]:
                    return None
                part = os.read(self.source, 1 << 20)
                if not part:
                    raise ConnectionError("the browser has ended")
                self.rest += part
            text, self.rest = self.rest.split(b"\0", 1)
            message = json.loads(text)
            if "id" in message:
                return message
            self.note(message)

    def note(self, event):
        method, parameters = event.get("method"), event.get("params", {})
        if method == "Runtime.exceptionThrown":
            details = parameters["exceptionDetails"]
            self.errors.append(details.get("exception", {}).get("description", details["text"]))
        elif method == "Runtime.consoleAPICalled" and parameters["type"] in ("error", "warning", "assert"):
            self.errors.append(" ".join(str(a.get("value", a.get("description"))) for a in parameters["args"]))
        elif method == "Log.entryAdded" and parameters["entry"]["level"] == "error":
            self.errors.append(parameters["entry"]["text"] + " " + parameters["entry"].get("url", ""))

    def wait(self, seconds):
        """Looks at events meanwhile."""
        deadline = time.monotonic() + seconds
        while self.read(deadline) is not None:
            pass

    def open(self, url):
        self.call("Page.navigate", url=url)

    def ask(self, expression):
        """The value of an expression of JavaScript."""
        reply = self.call("Runtime.evaluate", expression=expression, returnByValue=True, awaitPromise=True)
        if "exceptionDetails" in reply:
            raise RuntimeError(f"{expression}: {reply['exceptionDetails']}")
        return reply["result"].get("value")

    def wait_for(self, expression, seconds=30):
        """Whether the expression became true in that time."""
        deadline = time.monotonic() + seconds
        while time.monotonic() < deadline:
            try:
                if self.ask(f"Boolean({expression})"):
                    return True
            except RuntimeError:  # while the page is being replaced
                pass
            self.wait(0.2)
        return False

    def picture(self, file):
        data = self.call("Page.captureScreenshot", format="png")["data"]
        pathlib.Path(file).write_bytes(base64.b64decode(data))

    def close(self):
        self.process.terminate()
        self.process.wait()
        os.close(self.out)
        os.close(self.source)
        self.folder.cleanup()
