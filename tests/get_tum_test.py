# SPDX-License-Identifier: BSD-3-Clause
"""scripts/get_tum against a server on this computer that holds tiny archives, with curl and with wget."""
import contextlib
import io
import os
import pty
import resource
import shutil
import signal
import socket
import subprocess
import tarfile
import tempfile
import threading
import time
import unittest
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path

SCRIPT = Path(__file__).resolve().parent.parent / "scripts" / "get_tum"
NEEDED = ("bash awk cat df env flock grep gzip head mkdir mktemp mv od rm sed sleep stat tar tr").split()
PAPER = ("walking_halfsphere walking_xyz walking_rpy walking_static sitting_halfsphere sitting_xyz").split()
XYZ = "rgbd_dataset_freiburg3_walking_xyz"
XYZ_PATH = f"/freiburg3/{XYZ}.tgz"
COMPLETE = ("rgb.txt", "depth.txt", "groundtruth.txt")


def archive(name, files=COMPLETE, size=30000):
    """A sequence packed; its picture does not get smaller by packing."""
    contents = {file: b"# time what\n" for file in files}
    contents["rgb/1.png"] = os.urandom(size)
    packed = io.BytesIO()
    with tarfile.open(fileobj=packed, mode="w:gz") as tar:
        for file, data in contents.items():
            member = tarfile.TarInfo(f"{name}/{file}")
            member.size = len(data)
            tar.addfile(member, io.BytesIO(data))
    return packed.getvalue()


class Server(ThreadingHTTPServer):
    """Gives `files` by path, parts of them as well, and notes each request with its Range."""

    daemon_threads = True

    def __init__(self):
        super().__init__(("127.0.0.1", 0), Handler)
        self.files = {}
        self.requests = []
        self.ranges = True
        self.kind = "application/gzip"
        self.breaks_at = []  # where in the file each of the next answers breaks off
        self.stalls = threading.Event()  # set: an answer that breaks off keeps the connection
        self.url = f"http://127.0.0.1:{self.server_address[1]}"


class Handler(BaseHTTPRequestHandler):
    def log_message(self, *_):
        pass

    def do_GET(self):
        asked = self.headers.get("Range")
        self.server.requests.append((self.path, asked))
        data = self.server.files.get(self.path)
        if data is None:
            self.send_error(404)
            return
        start = int(asked.removeprefix("bytes=").rstrip("-")) if asked and self.server.ranges else 0
        if start and start >= len(data):
            self.send_response(416)
            self.send_header("Content-Range", f"bytes */{len(data)}")
            self.send_header("Content-Length", "0")
            self.end_headers()
            return
        self.send_response(206 if start else 200)
        if start:
            self.send_header("Content-Range", f"bytes {start}-{len(data) - 1}/{len(data)}")
        self.send_header("Content-Type", self.server.kind)
        self.send_header("Content-Length", str(len(data) - start))
        self.end_headers()
        end = self.server.breaks_at.pop(0) if self.server.breaks_at else len(data)
        with contextlib.suppress(ConnectionError):
            self.wfile.write(data[start:end])
            self.wfile.flush()
            while end < len(data) and self.server.stalls.is_set():
                time.sleep(0.01)


class Harness:
    """Runs the script with one tool to download, in a folder of its own and with the server at hand."""

    tool = ""

    def setUp(self):
        scratch = tempfile.TemporaryDirectory()
        self.addCleanup(scratch.cleanup)
        self.scratch = Path(scratch.name)
        self.out = self.scratch / "out"
        self.part = self.out / f"{XYZ}.tgz.part"
        self.commands = self.scratch / "bin"
        self.commands.mkdir()
        for name in (*NEEDED, self.tool):
            if found := shutil.which(name):
                (self.commands / name).symlink_to(found)
        self.server = Server()
        thread = threading.Thread(target=self.server.serve_forever, args=(0.02,))
        thread.start()
        self.addCleanup(self.server.server_close)
        self.addCleanup(thread.join)
        self.addCleanup(self.server.shutdown)
        self.addCleanup(self.server.stalls.clear)
        self.server.files[XYZ_PATH] = archive(XYZ)

    def start(self, *arguments, out=None, server=None, **options):
        (self.scratch / "tmp").mkdir(exist_ok=True)
        environment = {"PATH": str(self.commands), "HOME": str(self.scratch), "TMPDIR": str(self.scratch / "tmp")}
        command = [SCRIPT, "--out", out or self.out, "--server", server or self.server.url, *arguments]
        options = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, "stdin": subprocess.DEVNULL, **options}
        process = subprocess.Popen(command, env=environment, text=True, **options)
        self.addCleanup(process.kill)
        return process

    def run_script(self, *arguments, code=0, **options):
        with self.start(*arguments, **options) as process:
            self.output, self.errors = process.communicate(timeout=60)
        self.assertEqual(process.returncode, code, self.output + self.errors)
        self.assertEqual(list((self.scratch / "tmp").iterdir()), [], "leftovers")
        self.assertNotIn("\r", self.output + self.errors)

    def expect_error(self, *words, lines=2):
        for word in words:
            self.assertIn(word, self.errors)
        self.assertEqual(len(self.errors.splitlines()), lines, self.errors)
        for line in self.errors.splitlines():
            self.assertTrue(line.startswith("get_tum: "), self.errors)

    def assert_out_holds(self, *names):
        self.assertEqual(sorted(path.name for path in self.out.iterdir()), sorted(names))

    def assert_ready(self):
        self.assert_out_holds(XYZ)
        for name in COMPLETE:
            self.assertTrue((self.out / XYZ / name).is_file())

    def wait_until(self, condition):
        deadline = time.monotonic() + 30
        while not condition():
            self.assertLess(time.monotonic(), deadline, "nothing happened")
            time.sleep(0.01)


class GetTum(Harness):
    def test_downloads_and_then_leaves_alone_what_is_there(self):
        self.run_script("walking_xyz")
        self.assert_ready()
        self.assertIn("Needs roughly 1.0 GB", self.output)
        self.assertIn("tum-fr3", self.output)
        self.assertEqual(self.server.requests, [(XYZ_PATH, None)])
        for name in ("fr3/walking_xyz", XYZ, "freiburg3_walking_xyz"):
            self.run_script(name)
            self.assertIn("already", self.output)
        self.assertEqual(len(self.server.requests), 1)

    def test_default_is_the_table_of_the_paper_in_its_order(self):
        paths = [f"/freiburg3/rgbd_dataset_freiburg3_{name}.tgz" for name in PAPER]
        for path, name in zip(paths, PAPER):
            self.server.files[path] = archive(f"rgbd_dataset_freiburg3_{name}")
        self.run_script()
        self.assertEqual([path for path, _ in self.server.requests], paths)
        self.assert_out_holds(*(f"rgbd_dataset_freiburg3_{name}" for name in PAPER))

    def test_resumes(self):
        whole = self.server.files[XYZ_PATH]
        self.out.mkdir()
        self.part.write_bytes(whole[:10000])
        self.run_script("walking_xyz")
        self.assert_ready()
        self.assertEqual(self.server.requests, [(XYZ_PATH, "bytes=10000-")])

    def test_unpacks_what_was_downloaded_whole(self):
        self.out.mkdir()
        self.part.write_bytes(self.server.files[XYZ_PATH])
        self.run_script("walking_xyz")
        self.assert_ready()

    def test_starts_anew_where_what_is_there_is_of_another_file(self):
        self.out.mkdir()
        for size in (10000, 90000):
            self.part.write_bytes(archive(XYZ, size=size))
            self.run_script("walking_xyz")
            self.assert_ready()
            shutil.rmtree(self.out / XYZ)

    def test_downloads_anew_from_a_server_that_knows_no_ranges(self):
        self.server.ranges = False
        self.out.mkdir()
        self.part.write_bytes(self.server.files[XYZ_PATH][:10000])
        self.run_script("walking_xyz")
        self.assert_ready()

    def test_goes_on_by_itself_after_a_connection_that_broke(self):
        self.server.breaks_at = [10000, 20000]
        self.run_script("walking_xyz")
        self.assert_ready()
        self.assertEqual([asked for _, asked in self.server.requests], [None, "bytes=10000-", "bytes=20000-"])

    def test_keeps_what_it_has_where_the_connection_breaks_again_and_again(self):
        self.server.breaks_at = [10000, 10000]
        self.run_script("walking_xyz", code=1)
        self.expect_error(self.server.url + XYZ_PATH, "broke off", "call again to resume", lines=1)
        self.assert_out_holds(self.part.name)
        self.run_script("walking_xyz")
        self.assert_ready()

    def test_gives_up_where_the_connection_breaks_and_cannot_be_resumed(self):
        self.server.ranges = False
        self.server.breaks_at = [10000] * 20
        self.run_script("walking_xyz", code=1)
        self.expect_error(self.server.url + XYZ_PATH, "broke off", lines=1)
        self.assertLess(len(self.server.requests), 5)

    def test_missing_on_the_server_and_the_others_are_downloaded(self):
        self.run_script("walking_rpy", "walking_xyz", code=1)
        self.expect_error("freiburg3/rgbd_dataset_freiburg3_walking_rpy.tgz", "404", "--server")
        self.assert_ready()

    def test_truncated_archive(self):
        self.server.files[XYZ_PATH] = self.server.files[XYZ_PATH][:20000]
        self.run_script("walking_xyz", code=1)
        self.expect_error(self.server.url + XYZ_PATH, "truncated", "call again")
        self.assert_out_holds()

    def test_web_page_instead_of_an_archive(self):
        self.server.files[XYZ_PATH] = b"<!DOCTYPE html><p>Please log in"
        self.server.kind = "text/html; charset=utf-8"
        self.run_script("walking_xyz", code=1)
        self.expect_error(self.server.url + XYZ_PATH, "not an archive", "browser")
        self.assert_out_holds()

    def test_archive_without_truth(self):
        self.server.files[XYZ_PATH] = archive(XYZ, ("rgb.txt",))
        self.run_script("walking_xyz", code=1)
        self.expect_error(self.server.url + XYZ_PATH, "lacks depth.txt, groundtruth.txt", "--server")
        self.assert_out_holds()

    def test_folder_that_is_no_sequence_is_not_touched(self):
        (self.out / XYZ).mkdir(parents=True)
        self.run_script("walking_xyz", code=1)
        self.expect_error(str(self.out / XYZ), "lacks rgb.txt", "move it away")
        self.assertEqual(self.server.requests, [])

    def test_archive_of_another_folder_name_or_none(self):
        for name in ("walking", "."):
            self.server.files[XYZ_PATH] = archive(name)
            self.run_script("walking_xyz")
            self.assert_ready()
            shutil.rmtree(self.out / XYZ)

    def test_folder_that_cannot_be_made(self):
        (self.scratch / "file").write_text("")
        self.run_script("walking_xyz", out=self.scratch / "file" / "out", code=1)
        self.expect_error(str(self.scratch / "file"), "Not a directory", "--out", lines=1)

    @unittest.skipIf(os.geteuid() == 0, "root may write anywhere")
    def test_folder_that_cannot_be_written(self):
        self.out.mkdir(mode=0o555)
        self.run_script("walking_xyz", code=1)
        self.expect_error(str(self.out), "cannot write", "--out", lines=1)

    def limited_to(self, size):
        """A limit of the size of files stands in for a full disk."""
        return {"preexec_fn": lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (size, size)),
                "restore_signals": False}  # SIGXFSZ stays ignored, as Python has it

    def test_disk_full_while_downloading(self):
        self.run_script("walking_xyz", code=1, **self.limited_to(10000))
        self.expect_error(str(self.part), "free some space", "--out", lines=1)
        self.run_script("walking_xyz")
        self.assert_ready()

    def test_disk_full_while_unpacking(self):
        packed = io.BytesIO()
        with tarfile.open(fileobj=packed, mode="w:gz") as tar:
            member = tarfile.TarInfo(f"{XYZ}/rgb.txt")
            member.size = 1000000
            tar.addfile(member, io.BytesIO(bytes(member.size)))
        self.server.files[XYZ_PATH] = packed.getvalue()
        self.run_script("walking_xyz", code=1, **self.limited_to(100000))
        self.expect_error("cannot unpack", str(self.part), "free some space", lines=1)
        self.assert_out_holds(self.part.name)

    def test_no_answer_and_unknown_host(self):
        with socket.socket() as unused:
            unused.bind(("127.0.0.1", 0))
            server = f"http://127.0.0.1:{unused.getsockname()[1]}/"
            self.run_script("walking_xyz", "walking_rpy", server=server, code=1)
        self.expect_error(server + XYZ_PATH[1:], "does not answer", "check the network", lines=1)
        server = f"http://{'x' * 64}.invalid"  # a longer name than there can be
        self.run_script("walking_xyz", server=server, code=1)
        self.expect_error(server + XYZ_PATH, "unknown", "check the network", lines=1)

    def test_wrong_usage(self):
        self.run_script("walking_xyz", "flying_xyz", code=2)
        self.assertIn("flying_xyz", self.errors.splitlines()[0])
        self.assertEqual([line.strip() for line in self.errors.splitlines()[1:7]], [f"fr3/{name}" for name in PAPER])
        for arguments, words in ((["desk"], ["fr1/desk fr2/desk"]), (["--fast"], ["--fast"]), (["--out"], ["--out"]),
                                 (["--server", "example"], ["--server", "https://"]), (["--out="], ["--out"])):
            self.run_script(*arguments, code=2)
            self.expect_error(*words, "--help", lines=1)
        self.assertEqual(self.server.requests, [])
        self.assertFalse(self.out.exists())

    def test_list_and_help(self):
        self.run_script("--list")
        rows = [line.split() for line in self.output.splitlines()]
        self.assertEqual([row[0] for row in rows[:6]], [f"fr3/{name}" for name in PAPER])
        for name in ("fr3/sitting_rpy", "fr3/sitting_static", "fr3/long_office_household", "fr1/desk", "fr2/xyz"):
            self.assertIn([name, "tum-" + name[:3], "about"], [row[:3] for row in rows])
        self.run_script("--help")
        for word in ("Usage", "--out", "--server", "--list", "CC BY 4.0", "Exit code", "Ctrl-C"):
            self.assertIn(word, self.output)
        self.assertFalse(self.out.exists())

    def test_ctrl_c_while_downloading_keeps_what_can_be_resumed(self):
        self.server.breaks_at = [10000]
        self.server.stalls.set()
        with self.start("walking_xyz", start_new_session=True) as process:
            self.wait_until(lambda: self.part.exists() and self.part.stat().st_size > 0)
            second = self.start("walking_rpy")
            self.assertIn("another get_tum", second.communicate(timeout=60)[1])
            self.assertEqual(second.returncode, 1)
            os.killpg(process.pid, signal.SIGINT)
            self.assertIn("interrupted", process.communicate(timeout=60)[1])
        self.assertEqual(process.returncode, 130)
        self.assert_out_holds(self.part.name)
        size = self.part.stat().st_size
        self.server.stalls.clear()
        self.run_script("walking_xyz")
        self.assert_ready()
        self.assertEqual(self.server.requests[-1], (XYZ_PATH, f"bytes={size}-"))

    def test_ctrl_c_while_unpacking_leaves_no_half_sequence(self):
        (self.commands / "tar").unlink()
        (self.commands / "tar").write_text('#!/usr/bin/env bash\necho half >"$4/rgb.txt"\nexec sleep 60\n')
        (self.commands / "tar").chmod(0o755)
        for number, code in ((signal.SIGINT, 130), (signal.SIGTERM, 143)):
            with self.start("walking_xyz", start_new_session=True) as process:
                self.wait_until((self.out / f".{XYZ}.unpacking" / "rgb.txt").exists)
                os.kill(process.pid, number)  # it alone, so that it has to end what it started
                process.communicate(timeout=60)
            self.assertEqual(process.returncode, code)
            self.assert_out_holds(self.part.name)

    def test_shows_progress_on_a_terminal(self):
        master, terminal = pty.openpty()
        os.set_blocking(master, False)
        with self.start("walking_xyz", stderr=terminal) as process:
            process.communicate(timeout=60)
        shown = os.read(master, 10000).decode()
        os.close(terminal)
        os.close(master)
        self.assertEqual(process.returncode, 0, shown)
        self.assertIn("\rfr3/walking_xyz: 0 of 0 MB, 100 % ", shown)


@unittest.skipUnless(shutil.which("curl"), "needs curl")
class WithCurl(GetTum, unittest.TestCase):
    tool = "curl"

    def test_keeps_what_it_has_where_a_web_page_is_in_the_place_of_the_rest(self):
        self.out.mkdir()
        self.part.write_bytes(self.server.files[XYZ_PATH][:10000])
        self.server.files[XYZ_PATH] = b"<!DOCTYPE html><p>Please log in"
        self.server.kind = "text/html"
        self.server.ranges = False
        self.run_script("walking_xyz", code=1)
        self.expect_error("not an archive")
        self.assertEqual(self.part.stat().st_size, 10000)


@unittest.skipUnless(shutil.which("wget"), "needs wget")
class WithWget(GetTum, unittest.TestCase):
    tool = "wget"


class WithNeither(Harness, unittest.TestCase):
    def test_says_what_to_install(self):
        self.run_script("walking_xyz", code=1)
        self.expect_error("curl or wget", "apt-get install curl", lines=1)


if __name__ == "__main__":
    unittest.main()
