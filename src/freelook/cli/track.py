"""Show a head tracker live: angles, rate, jitter, dropouts, age; or record it.

  freelook track opentrack:4242
  freelook track 'csv:/dev/ttyACM0?columns=yaw,pitch,roll' --seconds 10
  freelook track opentrack:4242 --record poses.csv

A recording is a CSV file that the tracker 'script:' and 'freelook render --poses' read back.
Signs: turn right, look up, put the right ear down: yaw, pitch, roll must grow. Exit status 1 when
no pose came at all.
"""

from __future__ import annotations

import argparse
import contextlib
import threading
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import IO

from ..clock import NS_PER_S, now_ns
from ..errors import TrackerError
from ..pose_script import ANGLES
from ..rotations import head_angles_deg
from ..trackers import open_tracker
from ..types import Pose, Tracker
from ._pose_meter import PoseMeter, Reading
from ._track_table import display

TERMINAL_PERIOD_S = 0.1
LINE_PERIOD_S = 1.0

Show = Callable[[Reading, str, dict[str, int]], None]


def add_arguments(parser: argparse.ArgumentParser) -> None:
    add_tracker_arguments(parser)
    parser.add_argument("--record", metavar="CSV", help="write every pose to this file")
    parser.add_argument("--overwrite", action="store_true", help="replace the file if it exists")


def add_tracker_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "tracker", metavar="TRACKER", help="KIND:ARGUMENT?option=value, as for 'fly --tracker'"
    )
    parser.add_argument(
        "--seconds", type=_positive, metavar="S", help="stop after so long (default: at Ctrl-C)"
    )


def run(args: argparse.Namespace) -> int:
    with contextlib.ExitStack() as stack:
        on_pose = None
        if args.record:
            on_pose = stack.enter_context(recording(Path(args.record), overwrite=args.overwrite))
        return watch(args.tracker, args.seconds, on_pose or (lambda pose: None))


def watch(spec: str, seconds: float | None, on_pose: Callable[[Pose], None]) -> int:
    """Open a tracker, hand every pose to `on_pose` and show how it does. The exit status."""
    tracker = open_tracker(spec)
    watcher = Watcher(tracker, on_pose)
    try:
        with display(spec) as (show, live):
            watcher.start()
            with contextlib.suppress(KeyboardInterrupt):
                watcher.follow(show, seconds, TERMINAL_PERIOD_S if live else LINE_PERIOD_S)
    finally:
        watcher.close()
    if watcher.failure is not None:
        raise watcher.failure
    return 0 if watcher.read().poses else 1


class Watcher:
    """Reads a tracker on its own thread and keeps its meter."""

    def __init__(self, tracker: Tracker, on_pose: Callable[[Pose], None]) -> None:
        self._tracker = tracker
        self._on_pose = on_pose
        self._meter = PoseMeter()
        self._lock = threading.Lock()
        self._ended = threading.Event()
        self._thread = threading.Thread(target=self._run, name="tracker", daemon=True)
        self.failure: BaseException | None = None

    def start(self) -> None:
        self._thread.start()

    def follow(self, show: Show, seconds: float | None, period_s: float) -> None:
        """Show a reading every period until the tracker ends, or so many seconds have passed."""
        end_ns = None if seconds is None else now_ns() + round(seconds * NS_PER_S)
        ended = False
        while not ended:
            left_s = period_s if end_ns is None else (end_ns - now_ns()) / NS_PER_S
            ended = self._ended.wait(max(0.0, min(period_s, left_s))) or left_s <= period_s
            message = "" if self._fresh() else self._tracker.message
            show(self.read(), message, dict(self._tracker.counters.values))

    def read(self) -> Reading:
        with self._lock:
            return self._meter.read(now_ns())

    def close(self) -> None:
        self._tracker.close()
        if self._thread.ident is not None:
            self._thread.join(2.0)

    def _fresh(self) -> bool:
        age_ms = self.read().age_ms
        return age_ms is not None and age_ms < 500

    def _run(self) -> None:
        try:
            for pose in self._tracker.poses():
                with self._lock:
                    self._meter.add(pose)
                self._on_pose(pose)
        except BaseException as error:  # re-raised by the thread that shows
            self.failure = error
        finally:
            self._ended.set()


@contextlib.contextmanager
def recording(path: Path, *, overwrite: bool) -> Iterator[Callable[[Pose], None]]:
    """A function that appends a pose to a new CSV file. TrackerError when it cannot be written."""
    try:
        file = path.open("w" if overwrite else "x", encoding="utf-8")
    except FileExistsError:
        raise TrackerError(f"{path} exists; choose another name or add --overwrite") from None
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or error
        raise TrackerError(f"{path} cannot be written: {reason}") from None
    with file:
        file.write(",".join(ANGLES) + "\n")
        yield _Recorder(file)


class _Recorder:
    """Times count from the first pose; a pose that is not later than the one before is left out,
    because a script's times grow."""

    def __init__(self, file: IO[str]) -> None:
        self._file = file
        self._first_ns: int | None = None
        self._last_us = -1

    def __call__(self, pose: Pose) -> None:
        if self._first_ns is None:
            self._first_ns = pose.t_ns
        t_us = (pose.t_ns - self._first_ns) // 1000
        if t_us <= self._last_us:
            return
        self._last_us = t_us
        yaw, pitch, roll = head_angles_deg(pose.body_from_view)
        self._file.write(f"{t_us / 1e6:.6f},{yaw:.5f},{pitch:.5f},{roll:.5f}\n")


def _positive(text: str) -> float:
    try:
        value = float(text)
    except ValueError:
        value = 0.0
    if not 0 < value < 1e6:
        raise argparse.ArgumentTypeError(f"{text!r} is not a number of seconds above 0")
    return value
