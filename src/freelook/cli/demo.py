"""Fly a simulated camera: nothing to connect, nothing to calibrate.

Simulates a flying vehicle with a fisheye camera, streams it over the loopback interface as a real
camera would, and serves the page; the head moves by itself until you touch anything. Stop with
Ctrl-C.
"""

from __future__ import annotations

import argparse
import asyncio
import contextlib
import os
import sys
import time
from collections import deque
from functools import partial

from ..datagrams import free_port
from ..errors import FreelookError
from ..formats import load_camera
from .fly import add_flying_arguments, fly

LENS = "demo"
# simulator, encoder, station and browser share the cores
FEW_CORES = (os.cpu_count() or 1) < 4
SIZE, THREADS = ("720x720", "1") if FEW_CORES else ("960x960", "2")
FPS = "30"
HEAD = "wander"
USUAL_START_S = 4.0
LAST_LINES = 8
LAST_WORDS_S = 3.0


def add_arguments(parser: argparse.ArgumentParser) -> None:
    add_flying_arguments(parser)


def run(args: argparse.Namespace) -> int:
    from ..ingest import Ingest
    from ..sources import open_source
    from ..web.station import About

    args.tracker = args.tracker or [HEAD]
    address = f"rtp://127.0.0.1:{free_port()}"
    about = About(
        "simulated flight",
        True,
        args.hold,
        args.ease,
        args.hfov,
        args.limit,
        args.projection,
        args.hud,
    )
    started_s = time.monotonic()
    fly(
        args,
        Ingest(lambda: open_source(address)),
        load_camera(LENS),
        about,
        partial(simulated_camera, address),
        lambda state: waiting_for_camera(state, time.monotonic() - started_s),
    )
    return 0


def waiting_for_camera(state: str, waited_s: float) -> str:
    """What to say instead of the source's message while there is no video yet."""
    if state != "connecting":
        return ""
    return "starting the simulated camera" + (
        ": compiling (first run only)" if waited_s > USUAL_START_S else ""
    )


async def simulated_camera(address: str) -> None:
    """Run the simulation in a process of its own.

    FreelookError with its last words when it ends by itself.
    """
    child = await asyncio.create_subprocess_exec(
        *(sys.executable, "-m", f"{__package__}._leashed", "simulate", address),
        *("--lens", LENS, "--size", SIZE, "--fps", FPS, "--threads", THREADS),
        stdin=asyncio.subprocess.PIPE,
        stdout=asyncio.subprocess.DEVNULL,
        stderr=asyncio.subprocess.PIPE,
        start_new_session=True,  # Ctrl-C is for us; we end it
    )
    try:
        words = await last_lines(child.stderr)
        status = await child.wait()
        raise FreelookError(f"the simulated camera ended (exit status {status}): {words}")
    finally:
        await end(child)


async def last_lines(stream: asyncio.StreamReader | None) -> str:
    assert stream is not None
    lines: deque[str] = deque(maxlen=LAST_LINES)
    while data := await stream.read(4096):
        lines.extend(data.decode(errors="replace").splitlines())
    return "\n".join(lines) or "it said nothing"


async def end(child: asyncio.subprocess.Process) -> None:
    """Close its leash; kill it when it does not end by that."""
    if child.stdin is not None:
        child.stdin.close()
    try:
        await asyncio.wait_for(child.wait(), LAST_WORDS_S)
    except TimeoutError:
        with contextlib.suppress(ProcessLookupError):
            child.kill()
        await child.wait()
