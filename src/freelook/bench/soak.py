"""A flight with several outputs for minutes, while receivers stay, stall and vanish: does the
sender keep its rate, and does its memory stay as it is?

Everything runs as a user runs it: `freelook fly` in a process of its own, and ffmpeg's programs as
receivers, all on this machine.
"""

from __future__ import annotations

import re
import shutil
import signal
import subprocess
import sys
import tempfile
import threading
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, field
from pathlib import Path

from ..clock import NS_PER_S, now_ns
from ..datagrams import free_port
from ..errors import FreelookError
from ..sinks.rtspserver import python_with_gstreamer
from .resident import Resident, descendants, resident_bytes

VIEW = "640x360"
SOURCE_SIZE, SOURCE_FPS, SOURCE_S = "480x480", 20, 4
BITRATE = "4M"  # fills the buffers of a connection that nobody reads from in a few seconds
STEP_S = 2.0
START_S = 60.0  # at most: what renders may have to be compiled first
# of every minute: stopped from one second to the other; and killed every so many seconds
STALLS_S = (20.0, 50.0)
VANISHES_S = 20.0
LAST_S = 10.0
FREELOOK, SERVER = "freelook fly", "its RTSP server"


@dataclass
class Receiver:
    """An ffmpeg that takes pictures and keeps none. `begun` counts how often it was started."""

    name: str
    source: tuple[str, ...]
    stalls: bool = False
    vanishes: bool = False
    begun: int = 0
    pictures: int = 0
    _process: subprocess.Popen[str] | None = None
    _stopped: bool = False
    _seen: list[int] = field(default_factory=list)

    def tend(self, time_s: float) -> None:
        """What is due now: start it (again), stop it for a while, kill it."""
        if self._process is None or self._process.poll() is not None:
            self._start()
        elif self.vanishes and time_s % VANISHES_S < STEP_S:
            self.kill()
        elif self.stalls:
            self._stall(STALLS_S[0] <= time_s % 60 < STALLS_S[1])

    def kill(self) -> None:
        """Without a word to the sender."""
        if self._process is not None:
            self._process.kill()
            self._process.wait()
            self._process, self._stopped = None, False

    def _stall(self, stop: bool) -> None:
        assert self._process is not None
        if stop != self._stopped:
            self._process.send_signal(signal.SIGSTOP if stop else signal.SIGCONT)
            self._stopped = stop

    def _start(self) -> None:
        taking = ("-c", "copy", "-f", "null", "-", "-progress", "pipe:1")
        command = ["ffmpeg", "-v", "quiet", "-nostdin", *self.source, *taking]
        self._process = subprocess.Popen(command, stdout=subprocess.PIPE, text=True)
        self._stopped = False
        self.begun += 1
        self._seen.append(0)
        threading.Thread(
            target=self._count, args=(self._process, self.begun - 1), daemon=True
        ).start()

    def _count(self, process: subprocess.Popen[str], which: int) -> None:
        assert process.stdout is not None
        for line in process.stdout:
            key, _, value = line.strip().partition("=")
            if key == "frame" and value.strip().isdigit():
                self._seen[which] = int(value)
                self.pictures = sum(self._seen)
        process.stdout.close()


@dataclass(frozen=True)
class Soak:
    """What was seen. `rates` are the views a second of each output, as its status line said, one
    for each look; `missing` says what was left out and why."""

    seconds: float
    memory: list[Resident]
    receivers: list[Receiver]
    rates: dict[str, list[float]]
    last_line: str
    missing: str = ""


def run(minutes: float, advance: Callable[[], None] = lambda: None) -> Soak:
    """`advance` is called every `STEP_S`. FreelookError without ffmpeg, or when the flight ends."""
    if shutil.which("ffmpeg") is None:
        raise FreelookError("bench soak needs the ffmpeg program as receiver; install ffmpeg")
    served = python_with_gstreamer() is not None
    with tempfile.TemporaryDirectory() as folder, ExitStack() as opened:
        shows, receivers = _plan(Path(folder), served)
        flight = opened.enter_context(_flight(Path(folder), shows))
        for receiver in receivers:
            opened.callback(receiver.kill)
        memory, rates = _watch(flight, receivers, minutes * 60, advance)
        missing = "" if served else "the RTSP server: GStreamer's is not installed"
        return Soak(minutes * 60, memory, receivers, rates, flight.line, missing)


def steps(minutes: float) -> int:
    return round(minutes * 60 / STEP_S)


def _plan(folder: Path, served: bool) -> tuple[list[str], list[Receiver]]:
    """What the flight shows, and who receives it."""
    sdp, ts = folder / "view.sdp", f"udp://127.0.0.1:{free_port()}"
    shows = [f"stream:rtp://127.0.0.1:{free_port()},size={VIEW},bitrate={BITRATE},sdp={sdp}"]
    shows += [f"stream:{ts},size={VIEW},bitrate={BITRATE},yaw=30"]
    shows += [f"file:{folder / 'view.mp4'},size={VIEW}"]
    receivers = [
        Receiver("rtp", ("-protocol_whitelist", "file,udp,rtp", "-i", str(sdp))),
        Receiver("udp, vanishes", ("-i", ts), vanishes=True),
    ]
    if served:
        url = f"://127.0.0.1:{free_port()}/view"
        shows.append(f"stream:rtsp-server{url},size={VIEW},bitrate={BITRATE}")
        tcp, udp = (("-rtsp_transport", way, "-i", f"rtsp{url}") for way in ("tcp", "udp"))
        receivers += [
            Receiver("rtsp-server, TCP", tcp),
            Receiver("rtsp-server, TCP, stalls", tcp, stalls=True),
            Receiver("rtsp-server, TCP, vanishes", tcp, vanishes=True),
            Receiver("rtsp-server, UDP, vanishes", udp, vanishes=True),
        ]
    return shows, receivers


class _Flight:
    """`freelook fly` and what it last said."""

    def __init__(self, process: subprocess.Popen[str], outputs: int) -> None:
        self.process = process
        self.line = ""
        self._outputs = outputs
        self._live = threading.Event()
        threading.Thread(target=self._read, daemon=True).start()

    def _read(self) -> None:
        assert self.process.stdout is not None
        for line in self.process.stdout:
            self.line = line.strip()
            if len(self.rates()) == self._outputs:
                self._live.set()
        self._live.set()

    def wait_live(self) -> None:
        """Until every output is; FreelookError when the flight ends instead."""
        self._live.wait(START_S)
        self.check()

    def check(self) -> None:
        if self.process.poll() is not None:
            raise FreelookError(f"the flight ended by itself: {self.line}")

    def rates(self) -> dict[str, float]:
        """Of each output: what says `KIND:WHERE live 20/s`."""
        found = re.findall(r"(\w+:[^;]*?) live (\d+)/s", self.line)
        return {name: float(rate) for name, rate in found}


@contextmanager
def _flight(folder: Path, shows: list[str]) -> Iterator[_Flight]:
    recording = folder / "flight.mp4"
    program = [sys.executable, "-m", "freelook"]
    making = ["simulate", str(recording), "--size", SOURCE_SIZE, "--fps", str(SOURCE_FPS)]
    subprocess.run([*program, *making, "--seconds", str(SOURCE_S)], check=True, capture_output=True)
    flying = ["fly", str(recording), "--lens", "demo", "--loop", "--renderer", "cpu"]
    flying += ["--tracker", "wander", *(part for show in shows for part in ("--show", show))]
    pipe, errors = subprocess.PIPE, subprocess.STDOUT
    with subprocess.Popen([*program, *flying], stdout=pipe, stderr=errors, text=True) as process:
        try:
            flight = _Flight(process, len(shows))
            flight.wait_live()
            yield flight
        finally:
            process.send_signal(signal.SIGINT)
            try:
                process.wait(LAST_S)
            except subprocess.TimeoutExpired:
                process.kill()


def _watch(
    flight: _Flight, receivers: list[Receiver], seconds: float, advance: Callable[[], None]
) -> tuple[list[Resident], dict[str, list[float]]]:
    memory = {name: Resident(name) for name in (FREELOOK, SERVER)}
    rates: dict[str, list[float]] = {}
    begin_ns, never = now_ns(), threading.Event()
    for step in range(round(seconds / STEP_S)):
        due_s = step * STEP_S
        never.wait(max(0.0, due_s - (now_ns() - begin_ns) / NS_PER_S))
        flight.check()
        for receiver in receivers:
            receiver.tend(due_s)
        _note(memory, flight.process.pid, (now_ns() - begin_ns) / NS_PER_S)
        for name, rate in flight.rates().items():
            rates.setdefault(name, []).append(rate)
        advance()
    return [one for one in memory.values() if any(one.sizes)], rates


def _note(memory: dict[str, Resident], pid: int, time_s: float) -> None:
    memory[FREELOOK].add(time_s, resident_bytes(pid))
    memory[SERVER].add(time_s, sum(map(resident_bytes, descendants(pid))))
