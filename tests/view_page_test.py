# SPDX-License-Identifier: BSD-3-Clause
"""Opens the web page of a simulated flight in a headless browser: the map appears and grows, a restart is survived.

Usage: view_page_test.py PROGRAM [--seconds N] [--pictures FOLDER] [--dynamic MODE]
  --seconds    that the flight is watched for errors of the console
  --dynamic    of the flights, default geometry, which needs no network
  --pictures   where view.png, view_above.png, view_phone.png and view_phone_figures.png are written
Exit code: 0 all is well, 1 not, 77 there is no browser.
"""
import argparse
import json
import os
import pathlib
import signal
import socket
import subprocess
import sys
import tempfile
import time

sys.path.insert(0, str(pathlib.Path(__file__).parent))
import browser

HOSTILE = "<script>window.hacked=1</script><img src=x onerror='window.hacked=1'>"
WITHOUT_SERVER = ("ERR_CONNECTION_REFUSED", "ERR_INCOMPLETE_CHUNKED_ENCODING", "ERR_CONNECTION_RESET",
                  "ERR_EMPTY_RESPONSE")


def free_port():
    with socket.socket() as s:
        s.bind(("127.0.0.1", 0))
        return s.getsockname()[1]


def fly(program, folder, port, dynamic):
    return subprocess.Popen(
        [program, "run", "simulated:street", "--quiet", "--dynamic", dynamic, "--out", folder,
         "--view", f"127.0.0.1:{port}"], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)


def land(flight):
    flight.send_signal(signal.SIGINT)
    flight.wait(60)


def view_hostile(program, folder, port):
    """Shows a run whose source has a script for a name."""
    report = json.loads((folder / "run.json").read_text())
    report["source"] = HOSTILE
    (folder / "run.json").write_text(json.dumps(report))
    return subprocess.Popen([program, "view", str(folder), f"127.0.0.1:{port}"], stdout=subprocess.DEVNULL,
                            stderr=subprocess.DEVNULL)


def require(is_so, what):
    if not is_so:
        sys.exit(f"FAILED: {what}")
    print(f"ok: {what}", flush=True)


def counts(page):
    return page.ask("Object.assign(roslam.scene.count(), {frames: roslam.event.processed})")


def watch(page, seconds):
    begin = counts(page)
    deadline = time.monotonic() + seconds
    while time.monotonic() < deadline:
        page.wait(1.0)
    end = counts(page)
    for name in ("path", "landmarks", "surfaces", "frames"):
        require(end[name] > begin[name], f"{name} grew in {seconds} s from {begin[name]} to {end[name]}")
    require(page.ask("document.querySelector('#image').naturalWidth") > 100, "the image is there")
    require(page.ask("document.querySelector('#source').textContent") == "simulated:street", "the source is named")
    require(not page.errors, f"no errors in the console {page.errors}")


def take_pictures(page, phone, folder):
    page.picture(folder / "view.png")
    phone.picture(folder / "view_phone.png")
    page.ask("document.querySelector('[data-view=above]').click()")
    phone.ask("document.querySelector('[data-sheet=figures]').click()")
    phone.wait(2.0)
    page.wait(2.0)
    page.picture(folder / "view_above.png")
    phone.picture(folder / "view_phone_figures.png")


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("program")
    parser.add_argument("--seconds", type=float, default=15.0)
    parser.add_argument("--pictures", type=pathlib.Path)
    parser.add_argument("--dynamic", default="geometry")
    arguments = parser.parse_args()
    if browser.find() is None:
        print("skipped: there is no Chromium (apt-get install chromium)")
        return 77
    port = free_port()
    with tempfile.TemporaryDirectory() as scratch:
        flight = fly(arguments.program, scratch + "/first", port, arguments.dynamic)
        page = browser.Browser(1280, 800)
        phone = browser.Browser(390, 780, 1.5, True) if arguments.pictures else None
        try:
            require(wait_for_port(port), "the page is served")
            page.open(f"http://127.0.0.1:{port}/")
            if phone:
                phone.open(f"http://127.0.0.1:{port}/")
            require(page.wait_for("roslam.scene && roslam.link === 'up' && roslam.scene.count().path > 5 && "
                                  "roslam.scene.count().landmarks > 100 && roslam.scene.count().surfaces > 1000", 120),
                    "path, landmarks and surfaces appear")
            watch(page, arguments.seconds)
            if phone:
                take_pictures(page, phone, arguments.pictures)
                require(not phone.errors, f"no errors in the console of the phone {phone.errors}")
                phone.close()
                phone = None
            first = page.ask("roslam.event.run")
            land(flight)
            require(page.wait_for("document.querySelector('#state').textContent === 'run ended'", 20),
                    "the end of the run is shown")
            flight = fly(arguments.program, scratch + "/second", port, arguments.dynamic)
            require(page.wait_for(f"roslam.link === 'up' && roslam.event.run !== '{first}' && "
                                  "roslam.scene.count().path > 2", 120), "another run is taken up by itself")
            land(flight)
            flight = view_hostile(arguments.program, pathlib.Path(scratch) / "first", port)
            require(page.wait_for("roslam.link === 'up' && roslam.event.phase === 'recorded' && "
                                  "roslam.scene.count().surfaces > 1000", 60), "a run of earlier is shown")
            require(page.ask("document.querySelector('#source').textContent") == HOSTILE, "names are text")
            require(page.ask("window.hacked === undefined"), "scripts in names are not run")
            errors = [e for e in page.errors if not any(w in e for w in WITHOUT_SERVER)]
            require(not errors, f"no other errors in the console {errors}")
        finally:
            for each in (page, phone):
                if each:
                    each.close()
            if flight.poll() is None:
                land(flight)
    return 0


def wait_for_port(port):
    for _ in range(300):
        with socket.socket() as s:
            if s.connect_ex(("127.0.0.1", port)) == 0:
                return True
        time.sleep(0.1)
    return False


if __name__ == "__main__":
    sys.exit(main())
