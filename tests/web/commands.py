"""Commands of freelook as processes of their own."""

from __future__ import annotations

import signal
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager

import pytest


@contextmanager
def running(*arguments: str) -> Iterator[tuple[subprocess.Popen[str], str]]:
    """A command in its own process, and the address it printed."""
    process = subprocess.Popen(
        [sys.executable, "-m", "freelook", *arguments, "--port", "0", "--no-browser"],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    try:
        assert process.stdout is not None
        line = process.stdout.readline()
        if not line.startswith("view: http"):
            process.kill()
            pytest.fail(f"{line}{process.communicate()}")
        yield process, line.removeprefix("view: ").strip()
    finally:
        process.kill()
        process.communicate()


def stop(process: subprocess.Popen[str]) -> tuple[int, str, str]:
    """(exit status, output after the address, errors)"""
    assert process.stdout is not None
    assert process.stderr is not None
    process.send_signal(signal.SIGINT)
    status = process.wait(timeout=15)
    return status, process.stdout.read(), process.stderr.read()
