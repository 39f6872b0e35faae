"""What every tracker must do. A new one is tested here once `STAND_INS` knows how to feed it."""

from __future__ import annotations

import itertools
import math
import os
import socket
import struct
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from pathlib import Path
from types import SimpleNamespace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from freelook.axes import AXES
from freelook.clock import now_ns
from freelook.errors import TrackerError
from freelook.gimbal import CENTRE
from freelook.head import Head
from freelook.rotations import angle_between_deg, head_angles_deg
from freelook.trackers import joystick, known_trackers, open_tracker
from freelook.trackers.elrs import crc8_dvb_s2
from freelook.types import Pose, Tracker
from serial_device import SerialDevice

Feed = Callable[[Tracker], None]
StandIn = tuple[str, Feed]


def feed_nothing(tracker: Tracker) -> None:
    pass


def udp_stand_in(kind: str, datagram: bytes) -> Callable[[Path], StandIn]:
    def feed(tracker: Tracker) -> None:
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as out:
            out.sendto(datagram, tracker.address)  # type: ignore[attr-defined]

    return lambda tmp_path: (f"{kind}:127.0.0.1:0", feed)


OPENTRACK = struct.pack("<6d", 0, 0, 0, 30, 20, -10)
FREEPIE = struct.pack("<BB3f", 0, 2, *(math.radians(angle) for angle in (30, 20, 10)))
OSC = b"/bridge/quat\0\0\0\0,ddd\0\0\0\0" + struct.pack(">3d", 30, 20, 10)


def file_stand_in(tmp_path: Path) -> StandIn:
    path = tmp_path / "angles.txt"
    count = itertools.count()

    def feed(tracker: Tracker) -> None:
        path.write_text("10 20 30\n")
        os.utime(path, ns=(0, next(count) * 1_000_000_000))

    return f"file:{path}", feed


def serial_stand_in(kind: str, frame: bytes, options: str = "") -> Callable[[Path], StandIn]:
    def stand_in(tmp_path: Path) -> StandIn:
        device = SerialDevice(tmp_path, f"tty{kind}")
        PLUGGED_IN.callback(device.close)
        return f"{kind}:{device.path}{options}", lambda tracker: device.repeat(frame)

    return stand_in


PLUGGED_IN = ExitStack()
HATIRE = struct.pack("<HH6fH", 0xAAAA, 1, 30, -10, 20, 0, 0, 0, 0x5555)
ELRS = b"$X<\0\x83\x03\6\0" + struct.pack("<3H", *(992 + 10 * angle for angle in (30, 20, 10)))
ELRS += bytes([crc8_dvb_s2(ELRS[3:])])
IMU = b"0,0,0,0,0,1\n"  # still and level; it only can be told how it turns
DLKTDR = b'\x02{"panoff":30,"tiltoff":20,"rolloff":10,"Cmd":"Data"}AB\x03\r\n'


def joystick_stand_in(tmp_path: Path) -> StandIn:
    """What the kernel would say: values from -900 to 900, at tenths of degrees."""
    angles = dict(enumerate((300, 200, 100)))
    info = {number: SimpleNamespace(value=v, min=-900, max=900) for number, v in angles.items()}
    device = SimpleNamespace(absinfo=info.get, active_keys=list, close=lambda: None)
    patch = pytest.MonkeyPatch()
    patch.setattr(joystick, "open_device", lambda wanted: device)
    PLUGGED_IN.callback(patch.undo)
    return "joystick:made up", feed_nothing


@pytest.fixture(autouse=True)
def _unplug() -> Iterator[None]:
    yield
    PLUGGED_IN.close()


def script_stand_in(tmp_path: Path) -> StandIn:
    path = tmp_path / "poses.csv"
    path.write_text("t_s,yaw_deg,pitch_deg,roll_deg\n0,30,20,10\n")
    return f"script:{path}?loop=1", feed_nothing


def wander_stand_in(tmp_path: Path) -> StandIn:
    return "wander", feed_nothing


STAND_INS: dict[str, Callable[[Path], StandIn]] = {
    "csv": serial_stand_in("csv", b"30,20,10\n"),
    "dlktdr": serial_stand_in("dlktdr", DLKTDR),
    "elrs": serial_stand_in("elrs", ELRS, "?span=80"),
    "file": file_stand_in,
    "freepie": udp_stand_in("freepie", FREEPIE),
    "hatire": serial_stand_in("hatire", HATIRE),
    "imu": serial_stand_in("imu", IMU),
    "joystick": joystick_stand_in,
    "opentrack": udp_stand_in("opentrack", OPENTRACK),
    "osc": udp_stand_in("osc", OSC),
    "script": script_stand_in,
    "wander": wander_stand_in,
}


FLOAT_DEG = 2e-5  # some speak in single precision
TURNABLE = sorted(set(STAND_INS) - {"wander", "imu"})  # the others' heads are where they are told


@pytest.fixture(params=sorted(STAND_INS))
def stand_in(request: pytest.FixtureRequest, tmp_path: Path) -> StandIn:
    return STAND_INS[request.param](tmp_path)


@pytest.fixture
def tracker(stand_in: StandIn) -> Iterator[Tracker]:
    made = open_tracker(stand_in[0])
    yield made
    made.close()


def read_some(tracker: Tracker, feed: Feed, count: int) -> list[Pose]:
    poses = []
    feed(tracker)
    for pose in tracker.poses():
        poses.append(pose)
        if len(poses) == count:
            break
        feed(tracker)
    return poses


def test_every_tracker_is_tested_here() -> None:
    assert set(STAND_INS) == set(known_trackers())


def test_every_tracker_has_its_line_of_documentation_and_its_options() -> None:
    for kind, module in known_trackers().items():
        assert len((module.__doc__ or "").splitlines()[0]) > 20, kind
        assert not set(module.OPTIONS) & set(AXES), kind


def test_poses_come_with_their_arrival_times_on_the_given_clock(
    tracker: Tracker, stand_in: StandIn
) -> None:
    before = now_ns()
    poses = read_some(tracker, stand_in[1], 3)
    times = [pose.t_ns for pose in poses]
    assert before <= times[0] <= times[1] <= times[2] <= now_ns()
    assert tracker.counters["received"] >= 3


def test_a_waiting_tracker_says_so(tracker: Tracker) -> None:
    assert len(tracker.message) > 5


def test_close_from_another_thread_ends_poses_at_once(
    tracker: Tracker, wait_until: Callable[..., None]
) -> None:
    reader = threading.Thread(target=lambda: list(tracker.poses()))
    reader.start()
    start = time.monotonic()
    tracker.close()
    reader.join(5)
    assert not reader.is_alive()
    assert time.monotonic() - start < 1.0


def test_close_may_come_first_and_often(tracker: Tracker) -> None:
    tracker.close()
    tracker.close()
    assert list(tracker.poses()) == []


def test_recentre_disable_and_enable_work_with_each(
    tracker: Tracker, stand_in: StandIn, wait_until: Callable[..., None]
) -> None:
    head = Head("test", tracker)
    head.start()

    def is_so(state: str, off_deg: float) -> bool:
        stand_in[1](tracker)
        aim = head.aim(now_ns())
        return aim.state == state and angle_between_deg(aim.body_from_view, CENTRE) <= off_deg

    def recentred() -> bool:
        """Asked again and again, because the wandering head goes on at 24 degrees a second."""
        head.recentre(now_ns())
        return is_so("tracking", 3)

    try:
        wait_until(lambda: is_so("tracking", 180))
        wait_until(recentred)
        head.disable(now_ns())
        wait_until(lambda: is_so("disabled", 1e-9))
        head.enable(now_ns())
        wait_until(lambda: is_so("tracking", 180))
    finally:
        head.close()


@pytest.mark.parametrize("kind", TURNABLE)
def test_axes_can_be_changed(kind: str, tmp_path: Path) -> None:
    spec, feed = STAND_INS[kind](tmp_path)
    mark = "&" if "?" in spec else "?"
    tracker = open_tracker(f"{spec}{mark}yaw=-yaw&pitch=yaw*0.5&roll=0")
    try:
        (pose,) = read_some(tracker, feed, 1)
    finally:
        tracker.close()
    assert head_angles_deg(pose.body_from_view) == pytest.approx((-30, 15, 0), abs=FLOAT_DEG)


@pytest.mark.parametrize("kind", TURNABLE)
def test_the_same_head_is_the_same_pose_whatever_the_tracker(kind: str, tmp_path: Path) -> None:
    """Right, up and right ear down by 30, 20 and 10 degrees, each in its tracker's own signs."""
    spec, feed = STAND_INS[kind](tmp_path)
    tracker = open_tracker(spec)
    try:
        (pose,) = read_some(tracker, feed, 1)
    finally:
        tracker.close()
    assert head_angles_deg(pose.body_from_view) == pytest.approx((30, 20, 10), abs=FLOAT_DEG)


@pytest.mark.parametrize(
    ("spec", "words"),
    [
        ("", "unknown tracker ''.*known: .*file, .*opentrack, .*wander"),
        ("kinect:3", "unknown tracker 'kinect' in 'kinect:3'; known: "),
        ("wander?speed=3", "tracker wander: unknown option 'speed'; known: rate, yaw, pitch, roll"),
        ("wander?rate", "'rate' in 'wander.rate' is not an option; write name=value"),
        ("wander?rate=5&rate=6", "option 'rate' is given twice"),
        ("wander?rate=0", "tracker wander: rate must be a number from 1 to 1000, not '0'"),
        ("wander?rate=nan", "rate must be a number from 1 to 1000"),
        ("wander?yaw=2*yaw", "tracker wander: yaw=2.yaw is not understood"),
        ("wander:5", "tracker wander: it takes no argument, but was given '5'"),
        ("opentrack:port", "tracker opentrack: 'port' is not a port or host:port"),
        ("opentrack:65536", "'65536' is not a port"),
        ("opentrack:203.0.113.7:4242", "cannot listen on UDP 203.0.113.7 port 4242: .*another"),
        ("file", "tracker file: which file"),
        ("file:/", "is a directory"),
        ("script", "tracker script: which script"),
        ("script:/nowhere.csv", "tracker script: pose script /nowhere.csv: No such file"),
        ("script:/nowhere.csv?loop=yes", "loop must be 0 or 1, not 'yes'"),
    ],
)
def test_what_cannot_be_opened_is_explained(spec: str, words: str) -> None:
    with pytest.raises(TrackerError, match=words):
        open_tracker(spec)


words = st.text(max_size=10) | st.sampled_from(["rate=9", "yaw=0", "loop=1", "127.0.0.1:0", "0"])


@given(st.sampled_from(sorted(STAND_INS)), words, st.lists(words, max_size=3))
def test_any_text_is_a_tracker_or_an_error(kind: str, argument: str, options: list[str]) -> None:
    if not argument.isascii():  # a name that is not ASCII may be looked up on the network
        argument = argument.encode("ascii", "backslashreplace").decode()
    try:
        tracker = open_tracker(f"{kind}:{argument}" + ("?" + "&".join(options) if options else ""))
    except TrackerError:
        return
    tracker.close()
