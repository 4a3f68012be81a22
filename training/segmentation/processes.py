# SPDX-License-Identifier: BSD-3-Clause
"""Starts several training processes on one machine, as torchrun does; the one of PyTorch 1.13 fails on Python 3.11.

Two processes of one thread each train almost twice as fast on two cores as one process of two threads."""
import os
import signal
import socket
import subprocess
import sys


def free_port():
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return probe.getsockname()[1]


def start(count, arguments):
    """Runs `python3 -m training.segmentation ARGUMENTS` in count processes and waits; returns the first exit code that
    is not 0. A request to stop is passed on, so that all save and stop after the same step."""
    shared = {"WORLD_SIZE": str(count), "MASTER_ADDR": "127.0.0.1", "MASTER_PORT": str(free_port())}
    command = [sys.executable, "-m", "training.segmentation", *arguments]
    children = [subprocess.Popen(command, env={**os.environ, **shared, "RANK": str(rank), "LOCAL_RANK": str(rank)})
                for rank in range(count)]

    def pass_on(number, _):
        for child in children:
            child.send_signal(number)

    signal.signal(signal.SIGTERM, pass_on)
    signal.signal(signal.SIGINT, lambda *_: None)  # ctrl-C reaches the children by itself
    codes = [child.wait() for child in children]
    return next((code for code in codes if code), 0)
