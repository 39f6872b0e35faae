"""What all trackers on a serial port do, shown with the simplest of them."""

from __future__ import annotations

import os
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from freelook.clock import now_ns
from freelook.errors import TrackerError
from freelook.head import Head
from freelook.rotations import head_angles_deg
from freelook.trackers import open_tracker
from freelook.trackers._frames import rdf_from_axes
from freelook.trackers._lines import LONGEST_LINE, LineBuffer, parse_columns, parse_line
from freelook.types import Counters, Pose, Tracker
from serial_device import SerialDevice

WaitUntil = Callable[..., None]


@pytest.fixture
def device(tmp_path: Path) -> Iterator[SerialDevice]:
    with SerialDevice(tmp_path) as made:
        yield made


class Listening:
    """A tracker read on a thread."""

    def __init__(self, tracker: Tracker) -> None:
        self.tracker = tracker
        self.poses: list[Pose] = []
        self._thread = threading.Thread(target=self._run)
        self._thread.start()

    def yaw(self) -> float | None:
        return head_angles_deg(self.poses[-1].body_from_view)[0] if self.poses else None

    def end(self) -> None:
        self.tracker.close()
        self._thread.join(5)
        assert not self._thread.is_alive()

    def _run(self) -> None:
        for pose in self.tracker.poses():
            self.poses.append(pose)


@pytest.fixture
def listening(device: SerialDevice) -> Iterator[Listening]:
    made = Listening(open_tracker(f"csv:{device.path}"))
    yield made
    made.end()


def test_poses_come_from_the_port(
    device: SerialDevice, listening: Listening, wait_until: WaitUntil
) -> None:
    device.repeat(b"30,20,10\n")
    wait_until(lambda: listening.yaw() is not None)
    assert head_angles_deg(listening.poses[0].body_from_view) == pytest.approx((30, 20, 10))


def test_of_what_waits_the_newest_counts(
    device: SerialDevice, listening: Listening, wait_until: WaitUntil
) -> None:
    device.repeat(b"1,0,0\n2,0,0\n3,0,0\n")
    wait_until(lambda: listening.tracker.counters["received"] >= 9)
    counters = listening.tracker.counters
    wait_until(lambda: counters["dropped"] >= counters["received"] / 2)
    assert listening.yaw() == pytest.approx(3)


def test_a_device_that_was_pulled_out_is_waited_for_and_found_again(
    device: SerialDevice, listening: Listening, wait_until: WaitUntil
) -> None:
    device.repeat(b"1,0,0\n")
    wait_until(lambda: listening.yaw() is not None)
    device.unplug()
    wait_until(lambda: "was lost" in listening.tracker.message)
    wait_until(lambda: "cannot be opened: No such file" in listening.tracker.message)
    device.repeat(b"2,0,0\n")
    device.plug_in()
    wait_until(lambda: listening.yaw() == pytest.approx(2))
    assert listening.tracker.counters["reconnects"] == 1


def test_a_device_may_be_plugged_in_later(tmp_path: Path, wait_until: WaitUntil) -> None:
    listening = Listening(open_tracker(f"csv:{tmp_path}/ttyTEST0"))
    try:
        wait_until(lambda: "ttyTEST0 cannot be opened: No such file" in listening.tracker.message)
        with SerialDevice(tmp_path) as device:
            device.repeat(b"5,0,0\n")
            wait_until(lambda: listening.yaw() == pytest.approx(5))
        assert listening.tracker.counters["reconnects"] == 0
    finally:
        listening.end()


def test_silence_and_nonsense_are_told_apart(
    device: SerialDevice, listening: Listening, wait_until: WaitUntil
) -> None:
    wait_until(lambda: "open at 115200 baud, but it sends nothing" in listening.tracker.message)
    device.repeat(b"\x80\x12~" * 50)
    wait_until(lambda: "is the baud rate right" in listening.tracker.message)
    assert not listening.poses


def test_a_file_that_is_no_port_is_said(tmp_path: Path, wait_until: WaitUntil) -> None:
    (tmp_path / "file").write_text("1,2,3\n")
    listening = Listening(open_tracker(f"csv:{tmp_path}/file"))
    try:
        wait_until(lambda: "Inappropriate ioctl" in listening.tracker.message)
    finally:
        listening.end()


def test_it_ends_at_once_while_it_waits_to_try_again(tmp_path: Path, wait_until: WaitUntil) -> None:
    listening = Listening(open_tracker(f"csv:{tmp_path}/nothing"))
    wait_until(lambda: "cannot be opened" in listening.tracker.message)
    start = time.monotonic()
    listening.end()
    assert time.monotonic() - start < 0.2  # the waits between tries are longer


def test_a_port_is_one_readers_only(
    device: SerialDevice, listening: Listening, wait_until: WaitUntil
) -> None:
    device.repeat(b"1,0,0\n")
    wait_until(lambda: listening.yaw() is not None)
    second = Listening(open_tracker(f"csv:{device.path}"))
    try:
        wait_until(lambda: "cannot be opened" in second.tracker.message)
    finally:
        second.end()


@pytest.mark.parametrize("baud", ["0", "fast", "1e9", "nan"])
def test_baud_is_checked(baud: str) -> None:
    with pytest.raises(TrackerError, match="baud must be a number from 50 to 4e"):
        open_tracker(f"csv:/dev/ttyACM0?baud={baud}")


def test_a_port_must_be_named() -> None:
    with pytest.raises(TrackerError, match=r"which serial port\? write csv:/dev/ttyACM0; .*here"):
        open_tracker("csv")


def test_the_home_folder_is_understood(
    device: SerialDevice, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("HOME", os.fspath(device.path.parent))
    tracker = open_tracker("csv:~/ttyTEST0")
    tracker.close()
    assert str(device.path) in tracker.message


def test_recentre_and_disable_work_with_it(device: SerialDevice, wait_until: WaitUntil) -> None:
    device.repeat(b"30,20,0\n")
    head = Head("test", open_tracker(f"csv:{device.path}"))
    head.start()

    def yaw_pitch() -> tuple[float, float]:
        return head_angles_deg(head.aim(now_ns()).body_from_view)[:2]

    try:
        wait_until(lambda: yaw_pitch() == pytest.approx((30, 20)))
        head.recentre(now_ns())
        wait_until(lambda: yaw_pitch() == pytest.approx((0, 0), abs=1e-9))
        device.repeat(b"40,20,0\n")
        wait_until(lambda: yaw_pitch() == pytest.approx((10, 0), abs=1e-6))
        head.disable(now_ns())
        wait_until(lambda: yaw_pitch() == pytest.approx((0, 0), abs=1e-9))
    finally:
        head.close()


def test_lines_in_pieces() -> None:
    lines = LineBuffer(Counters())
    assert lines.feed(b"cut off\n1,2") == []
    assert lines.feed(b",3\r\n\r\n4,5,6") == [b"1,2,3"]
    assert lines.feed(b"\r7\n") == [b"4,5,6", b"7"]
    lines.clear()
    assert lines.feed(b"8\n9\n") == [b"9"]


def test_endless_lines_are_counted_once_and_skipped() -> None:
    counters = Counters()
    lines = LineBuffer(counters)
    lines.feed(b"\n")
    for _ in range(100):
        assert lines.feed(b"x" * LONGEST_LINE) == []
    assert lines.feed(b"\nnext\n") == [b"next"]
    assert counters["invalid"] == 1


@pytest.mark.parametrize(
    ("line", "values"),
    [
        (b"1,-2.5,3e1", (1, -2.5, 30)),
        (b"1; +.5 ;\t3.", (1, 0.5, 3)),
        (b"1 2\t3", (1, 2, 3)),
    ],
)
def test_numbers_of_a_line(line: bytes, values: tuple[float, ...]) -> None:
    assert parse_line(line, ("a", "b", "c")) == dict(zip("abc", values, strict=True))


@pytest.mark.parametrize(
    "line",
    [
        *(b"1,2", b"1,2,3,4", b"1,,3", b"1,x,3", b"nan,1,2", b"1,inf,2", b"1_0,2,3", b"1e999,2,3"),
        *("١,2,3".encode(), b"\xff,1,2", b"0x1,2,3"),
    ],
)
def test_what_are_no_numbers(line: bytes) -> None:
    assert parse_line(line, ("a", "b", "c")) is None


def test_a_label_is_skipped() -> None:
    assert parse_line(b"ypr 1 2", ("-", "a", "-")) == {"a": 1}


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("a,c", "columns=a,c: 'c' is not a column; known: a, b, and -"),
        ("a,a", "'a' is there twice"),
    ],
)
def test_columns_are_checked(text: str, words: str) -> None:
    with pytest.raises(TrackerError, match=words):
        parse_columns(text, ("a", "b"))


def test_axes_in_letters() -> None:
    assert rdf_from_axes("frd", "x").apply([1, 2, 3]) == pytest.approx([2, 3, 1])
    assert rdf_from_axes("flu", "x").apply([1, 2, 3]) == pytest.approx([-2, -3, 1])
    assert rdf_from_axes("rdf", "x").magnitude() == pytest.approx(0)


@pytest.mark.parametrize(
    ("letters", "words"),
    [
        ("", "is not three of r, l, d, u, f, b; for example mount=frd"),
        ("xyz", "is not three of"),
        ("frdd", "is not three of"),
        ("fbr", "two axes along one line"),
        ("fru", "is left-handed"),
    ],
)
def test_axes_that_are_none(letters: str, words: str) -> None:
    with pytest.raises(TrackerError, match=words):
        rdf_from_axes(letters, "mount")
