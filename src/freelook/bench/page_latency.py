"""Through the station into a real browser: picture age there, and head to changed view.

Everything runs as a user runs it: `freelook fly` in a process of its own, RTP and OpenTrack
datagrams over loopback, the page in headless Chromium. All clocks are one: the machine's
monotonic clock; the page's is tied to it by pings over the data channel.
"""

from __future__ import annotations

import json
import random
import shutil
import socket
import struct
import subprocess
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ..clock import NS_PER_MS, NS_PER_S, now_ns
from ..datagrams import free_port
from ..latency import TIME_BITS, check_bits
from .figures import Figure
from .stamped import SIZE
from .video_latency import WARM_UP, stamped_camera

TO_BROWSER = "stamp to frame in the page"
TO_DRAWN = "stamp to drawn"
POSE_TO_DRAWN = "pose datagram to first changed drawn frame"
GPU_TIME = "GPU (or its stand-in) time for one view"
DISPLAY_FRAME = "display frame of the browser"
POSE_HZ = 250
STEP_DEG = 8.0

CHROMIUM = ("chromium", "chromium-browser", "google-chrome", "chrome")
FLAGS = [
    "--no-sandbox",
    "--no-first-run",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
    "--autoplay-policy=no-user-gesture-required",
    "--use-angle=gl-egl",
    "--ignore-gpu-blocklist",
]

# These wrap the page's own steps. The stamp is read from the very planes that are drawn. "Drawn"
# is when the page has issued a view; what the GPU takes for it is measured by itself: waiting for
# each view (readPixels) would stop the page from doing anything else meanwhile.
PROBE = """() => {
  const feed = freelook.app.feed, log = window.bench = {frames: [], draws: [], ticks: []};
  const pictured = feed.onPicture;
  feed.onPicture = (times) => {
    const w = freelook.stats().size[0], bits = [];
    for (let i = 0; i < 56; i++) bits.push(feed.buffer[8 * w + 16 * i + 8] > 124 ? 1 : 0);
    pictured(times);
    log.frames.push([times.receivedMs, performance.now(), bits.join('')]);
  };
  const tick = (ms) => { log.ticks.push(ms); requestAnimationFrame(tick); };
  requestAnimationFrame(tick);
}"""
PROBE_POSES = """() => {
  const app = freelook.app, log = window.bench;
  log.ticks = [];
  const drawn = app.drawn.bind(app);
  app.drawn = (aim) => {
    log.draws.push([performance.now(), aim.q[2]]);
    drawn(aim);
  };
}"""
PROBE_GPU = """() => {
  const { screen, renderer: { gl } } = freelook.app, one = new Uint8Array(4), times = [];
  const finish = () => gl.readPixels(0, 0, 1, 1, gl.RGBA, gl.UNSIGNED_BYTE, one);
  for (let i = 0; i < 40; i++) {
    finish();
    const start = performance.now();
    screen.drawPanes([Math.cos(i / 200), 0, Math.sin(i / 200), 0]);
    finish();
    times.push(performance.now() - start);
  }
  return times;
}"""


@dataclass(frozen=True)
class PageLog:
    """What the page noted, page milliseconds; `offset_ms` leads to the station's clock."""

    frames: list[tuple[float, float, str]]
    draws: list[tuple[float, float]]
    ticks: list[float]
    offset_ms: float
    renderer: str

    def station_ms(self, page_ms: float) -> float:
        return page_ms + self.offset_ms


def measure(seconds: float, browser_path: str) -> tuple[list[Figure], str]:
    """The figures, and the name of what drew them."""
    pose_port = free_port()
    with (
        stamped_camera(seconds * 2 + 60) as (_, sdp),
        station(sdp, pose_port) as url,
        page(url, browser_path) as opened,
    ):
        opened.wait_for_timeout(seconds * 1000)  # the head at rest: the page draws each frame
        to_browser, to_drawn = frame_figures(read_log(opened))
        opened.evaluate(PROBE_POSES)  # starts the display frames anew
        steps = send_steps(pose_port, seconds)  # the head turning: it draws at display rate
        log = read_log(opened)
        gpu = Figure(GPU_TIME, opened.evaluate(PROBE_GPU))
    ticks = [b - a for a, b in zip(log.ticks, log.ticks[1:], strict=False)]
    return [
        to_browser,
        to_drawn,
        Figure(POSE_TO_DRAWN, pose_latencies(steps, log)),
        gpu,
        Figure(DISPLAY_FRAME, ticks[WARM_UP:]),
    ], log.renderer


def browser_path() -> str | None:
    """Chromium or Chrome on this machine."""
    return next(filter(None, map(shutil.which, CHROMIUM)), None)


@contextmanager
def station(sdp: Path, pose_port: int) -> Iterator[str]:
    """`freelook fly` for the stamped camera, with an OpenTrack head; yields the page's address."""
    lens = sdp.parent / "lens.json"
    parameters = {"f": SIZE[1] / 3.3}
    profile = {"freelook_lens": 1, "size": SIZE, "model": "equidistant", "parameters": parameters}
    lens.write_text(json.dumps(profile))
    command = [sys.executable, "-m", "freelook", "fly", str(sdp), "--lens", str(lens)]
    command += ["--tracker", f"opentrack:{pose_port}", "--port", "0", "--no-browser"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as process:
        assert process.stdout is not None
        try:
            line = process.stdout.readline()
            while line and not line.startswith("view: "):
                line = process.stdout.readline()
            if not line:
                raise RuntimeError("the station did not start")
            # keep its status lines from filling the pipe
            threading.Thread(target=process.stdout.read, daemon=True).start()
            yield line.removeprefix("view: ").strip()
        finally:
            process.terminate()


@contextmanager
def page(url: str, browser_path: str) -> Iterator[Any]:
    """The station's page, showing video and probed."""
    from playwright.sync_api import sync_playwright

    width, height = SIZE
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=browser_path, args=FLAGS)
        size = {"width": width, "height": height}
        opened = browser.new_page(viewport=size, bypass_csp=True)
        opened.goto(f"{url}?upload=planes" if "?" not in url else f"{url}&upload=planes")
        opened.wait_for_function("window.freelook?.stats().drawn > 30", timeout=60_000)
        opened.evaluate(PROBE)
        yield opened
        browser.close()


def send_steps(port: int, seconds: float) -> list[tuple[int, float]]:
    """OpenTrack datagrams at 250 Hz; the head jumps left or right every 0.15 to 0.25 s.

    Returns when each jump was sent, nanoseconds, and to which yaw in degrees.
    """
    steps: list[tuple[int, float]] = []
    rng, yaw, never = random.Random(1), STEP_DEG, threading.Event()
    start_ns = next_step_ns = now_ns()
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sender:
        for index in range(round(seconds * POSE_HZ)):
            due_ns = start_ns + index * NS_PER_S // POSE_HZ
            never.wait(max(0, due_ns - now_ns()) / NS_PER_S)
            jumps = now_ns() >= next_step_ns
            if jumps:
                yaw = -yaw
                next_step_ns = now_ns() + rng.randint(150, 250) * NS_PER_MS
            sent_ns = now_ns()
            sender.sendto(struct.pack("<6d", 0, 0, 0, yaw, 0, 0), ("127.0.0.1", port))
            if jumps:
                steps.append((sent_ns, yaw))
    return steps


def read_log(opened: Any) -> PageLog:
    log = opened.evaluate("window.bench")
    clock = opened.evaluate("freelook.latencies().clock")
    renderer = opened.evaluate("freelook.stats().renderer")
    return PageLog(log["frames"], log["draws"], log["ticks"], clock["offsetMs"], renderer)


def frame_figures(log: PageLog) -> tuple[Figure, Figure]:
    to_browser, to_drawn = Figure(TO_BROWSER), Figure(TO_DRAWN)
    for received_ms, drawn_ms, bits in log.frames[WARM_UP:]:
        word = int(bits[::-1], 2)
        time_us = word & ((1 << TIME_BITS) - 1)
        if word >> TIME_BITS == check_bits(time_us):
            to_browser.values_ms.append(log.station_ms(received_ms) - time_us / 1000)
            to_drawn.values_ms.append(log.station_ms(drawn_ms) - time_us / 1000)
    return to_browser, to_drawn


def pose_latencies(steps: list[tuple[int, float]], log: PageLog) -> list[float]:
    """For each jump, how long until a view that shows it was drawn; the first is warm-up.

    The third term of the head's quaternion has the sign of the yaw's.
    """
    draws = [(log.station_ms(page_ms), turned) for page_ms, turned in log.draws]
    latencies = []
    for sent_ns, yaw in steps[1:]:
        sent_ms = sent_ns / NS_PER_MS
        shown = [ms for ms, turned in draws if ms > sent_ms and turned * yaw > 0]
        if shown:
            latencies.append(shown[0] - sent_ms)
    return latencies
