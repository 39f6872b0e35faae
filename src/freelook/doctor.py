"""What works on this machine, and what to do about what does not.

Each check is a function that returns `Check` lines; `CHECKS` names them in the order in which
they are shown. Facts are passed in where that makes a check testable.
"""

from __future__ import annotations

import contextlib
import os
import platform
import re
import shutil
import socket
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from importlib import import_module, metadata
from pathlib import Path
from typing import Literal

from . import __version__
from .datagrams import BUFFER_BYTES
from .egl import best_device
from .renderers.choice import GlDevice, choose, has_moderngl

State = Literal["ok", "warn", "no"]

# what freelook cannot fly without; the other extras add to it
ESSENTIAL_EXTRAS = ("render", "video", "web")
EXTRAS = (*ESSENTIAL_EXTRAS, "rtsp", "cli", "gl", "window")
PROBED_SIZE = (1280, 720)
BROWSERS = ("chromium", "chromium-browser", "google-chrome", "firefox", "microsoft-edge")
PORTS = (
    ("tcp", 8042, "the page", "choose another: freelook fly --port N"),
    ("udp", 4242, "OpenTrack", "close the other receiver, or use another port in both programs"),
    ("udp", 5004, "RTP video", "close the other receiver, or send to another port"),
)
# a key frame of a 4K stream may arrive as a burst of so many bytes
BURST_BYTES = 2_000_000


@dataclass(frozen=True, slots=True)
class Check:
    """One line: `state` of `name`, `what` was found, and `todo` about it where there is any."""

    name: str
    state: State
    what: str
    todo: str = ""
    essential: bool = False


def examine() -> Iterator[Check]:
    """All lines, one after the other. A check that fails by itself is a line too."""
    for check in CHECKS:
        try:
            yield from check()
        except Exception as error:
            name = check.__name__.removeprefix("check_")
            yield Check(name, "warn", f"could not be examined: {type(error).__name__}: {error}")


def fit_to_fly(checks: Iterable[Check]) -> bool:
    """False when something essential is missing."""
    return not any(check.essential and check.state == "no" for check in checks)


def check_python() -> Iterator[Check]:
    where = f"{platform.system()} {platform.machine()}"
    yield Check("python", "ok", f"Python {platform.python_version()}, {where}")
    yield Check("freelook", "ok", f"freelook {__version__}")


def check_libraries() -> Iterator[Check]:
    requirements = metadata.requires("freelook") or []
    for extra in EXTRAS:
        yield libraries_line(extra, names_in_extra(requirements, extra), installed_version)


def names_in_extra(requirements: Iterable[str], extra: str) -> list[str]:
    """Names of the distributions that a package's metadata lists for one of its extras."""
    mark = re.compile(rf"""extra == ['"]{extra}['"]""")
    return [re.split(r"[^\w.-]", text, maxsplit=1)[0] for text in requirements if mark.search(text)]


def installed_version(name: str) -> str | None:
    try:
        return metadata.version(name)
    except metadata.PackageNotFoundError:
        return None


def libraries_line(extra: str, names: list[str], version: Callable[[str], str | None]) -> Check:
    versions = {name: version(name) for name in names}
    missing = [name for name, found in versions.items() if found is None]
    if missing:
        return Check(
            f"extra '{extra}'",
            "no",
            f"not installed: {', '.join(missing)}",
            f"pip install 'freelook[{extra}]'",
            essential=extra in ESSENTIAL_EXTRAS,
        )
    return Check(f"extra '{extra}'", "ok", ", ".join(f"{n} {v}" for n, v in versions.items()))


def check_codecs() -> Iterator[Check]:
    for name, mode, use in (
        ("h264", "r", "decode H.264"),
        ("hevc", "r", "decode H.265"),
        ("mjpeg", "r", "decode MJPEG"),
        ("libx264", "w", "encode H.264"),
        ("libx265", "w", "encode H.265"),
    ):
        found = _has_codec(name, mode)
        todo = "" if found else "install PyAV's own wheels: pip install --force-reinstall av"
        needed = "264" in name
        yield Check(use, "ok" if found else "no", f"FFmpeg's {name}", todo, essential=needed)
    for codec, use in (("h264", "H.264"), ("hevc", "H.265")):
        yield encoder_line(use, why_no_hardware(codec))


def why_no_hardware(codec: str) -> dict[str, str]:
    """FFmpeg's hardware encoders of this codec, each with why it is of no use (empty: it works)."""
    hardware = import_module(".media.hardware", __package__)
    names = [f"{codec}_{family}" for family in hardware.FAMILIES]
    return {name: hardware.why_not(name, PROBED_SIZE) for name in names}


def encoder_line(use: str, reasons: dict[str, str]) -> Check:
    """Which encoder streams are made with."""
    name = f"{use} streams"
    found = next((library for library, why in reasons.items() if not why), None)
    if found is not None:
        return Check(name, "ok", f"encoded by {found}, in hardware")
    return Check(name, "ok", f"encoded on the CPU; tried in vain: {', '.join(reasons)}")


def check_rtsp_server() -> Iterator[Check]:
    server = import_module(".sinks.rtspserver", __package__)
    yield rtsp_server_line(server.python_with_gstreamer(), server.PACKAGES)


def rtsp_server_line(python: str | None, packages: str) -> Check:
    if python is not None:
        return Check("RTSP server", "ok", f"GStreamer's, run by {python}")
    todo = f"to let players pull the view: sudo apt install {packages}"
    return Check("RTSP server", "ok", "none (needed only for stream:rtsp-server://)", todo)


def _has_codec(name: str, mode: str) -> bool:
    av = import_module("av")
    try:
        av.codec.Codec(name, mode)
    except ValueError:
        return False
    return True


def check_graphics() -> Iterator[Check]:
    yield from graphics_lines(best_device(), has_moderngl())


def graphics_lines(device: GlDevice | None, library: bool) -> Iterator[Check]:
    """What OpenGL there is, and which renderer is chosen by itself."""
    what = f"OpenGL by {device.renderer}" if device else "no OpenGL without a window"
    yield Check("graphics", "ok", f"{what} (not needed: the CPU renders too)")
    unused = device is not None and not device.software and not library
    todo = "to use the GPU: pip install 'freelook[gl]'" if unused else ""
    yield Check("renderer", "ok", str(choose("auto", device, library)), todo)


def check_processor() -> Iterator[Check]:
    cores = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count()
    threads = import_module("cv2").getNumThreads()
    numba_threads = import_module("numba").config.NUMBA_NUM_THREADS
    what = f"{cores} cores; OpenCV uses {threads} threads, Numba {numba_threads}"
    if (cores or 1) < 2:
        yield Check("processor", "warn", what, "decoding and rendering want 2 cores or more")
    else:
        yield Check("processor", "ok", what)


def check_cameras() -> Iterator[Check]:
    yield from camera_lines(Path("/dev"), Path("/sys/class/video4linux"))


def camera_lines(devices: Path, names: Path) -> Iterator[Check]:
    """One line for each /dev/video*, or one that says there is none."""
    found = sorted(devices.glob("video[0-9]*"))
    if not found:
        yield Check(
            "cameras", "warn", "none at /dev/video*", "plug one in, or fly a stream or file"
        )
    for device in found:
        label = names / device.name / "name"
        name = label.read_text(errors="replace").strip() if label.is_file() else "unnamed"
        if os.access(device, os.R_OK | os.W_OK):
            yield Check("camera", "ok", f"{device} {name}")
        else:
            todo = 'sudo usermod -aG video "$USER", then log in again'
            yield Check("camera", "no", f"{device} {name}: no permission to open it", todo)


def check_ports() -> Iterator[Check]:
    for kind, port, use, todo in PORTS:
        where = f"{kind} port {port} ({use})"
        if port_free(kind, port):
            yield Check("port", "ok", f"{where} is free")
        else:
            yield Check("port", "warn", f"{where} is in use", todo)


def port_free(kind: str, port: int) -> bool:
    stream = kind == "tcp"
    with socket.socket(type=socket.SOCK_STREAM if stream else socket.SOCK_DGRAM) as probe:
        if stream:  # as servers do: a port that was closed a moment ago is free
            probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        try:
            probe.bind(("", port))
        except OSError:
            return False
    return True


def check_udp_buffer() -> Iterator[Check]:
    with contextlib.suppress(FileNotFoundError):  # not Linux: nothing to say
        text = Path("/proc/sys/net/core/rmem_max").read_text()
        yield buffer_line(int(text))


def buffer_line(limit_bytes: int) -> Check:
    what = f"receive buffers up to {limit_bytes / 1e6:.1f} MB"
    if limit_bytes >= BURST_BYTES:
        return Check("UDP", "ok", what)
    todo = f"against losses in large key frames: sudo sysctl -w net.core.rmem_max={BUFFER_BYTES}"
    return Check("UDP", "warn", what, todo)


def check_browser() -> Iterator[Check]:
    found = [name for name in BROWSERS if shutil.which(name)]
    if found or platform.system() in ("Darwin", "Windows"):  # which come with one
        yield Check("browser", "ok", f"{found[0] if found else 'the system has one'}")
    else:
        todo = "open the page's address on another machine or a phone"
        yield Check("browser", "warn", "none on this machine", todo)
    yield Check(
        "browser codecs",
        "ok",
        "H.264 goes to browsers untouched; H.265 is transcoded, as few take it by WebRTC",
    )


def check_network() -> Iterator[Check]:
    address = outward_address()
    if address is None:
        yield Check("network", "warn", "no network but this machine itself", "connect for phones")
        return
    todo = "to let a phone in: freelook fly ... --host 0.0.0.0 (by https, which its sensors want)"
    yield Check("network", "ok", f"this machine is {address}", todo)


def outward_address() -> str | None:
    """This machine's address on its network. Nothing is sent: UDP only looks up the route."""
    with socket.socket(type=socket.SOCK_DGRAM) as probe:
        try:
            probe.connect(("192.0.2.1", 9))  # an address reserved for documentation
        except OSError:
            return None
        return str(probe.getsockname()[0])


CHECKS: tuple[Callable[[], Iterator[Check]], ...] = (
    check_python,
    check_libraries,
    check_codecs,
    check_rtsp_server,
    check_graphics,
    check_processor,
    check_cameras,
    check_ports,
    check_udp_buffer,
    check_browser,
    check_network,
)
