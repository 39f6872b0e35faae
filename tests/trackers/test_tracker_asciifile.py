"""Every look at the file is a call: nothing here waits for anything."""

from __future__ import annotations

import os
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from freelook.axes import AxisMap
from freelook.rotations import head_angles_deg
from freelook.trackers.asciifile import AngleFile, last_line, parse_line


class Desk:
    """A file, its writer, and somebody who looks."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self.file = AngleFile(path, AxisMap())
        self._ticks = 0

    def look(self) -> tuple[float, float, float] | None:
        """(roll, pitch, yaw), rounded, or None."""
        rotation = self.file.sample(0)
        if rotation is None:
            return None
        yaw, pitch, roll = head_angles_deg(rotation)
        return round(roll, 6), round(pitch, 6), round(yaw, 6)

    def write(self, text: str, *, mode: str = "w", tick: bool = True) -> None:
        """In place (w, a) with a new modification time, or within the same tick of the clock."""
        with self.path.open(mode, encoding="latin-1", newline="") as out:
            out.write(text)
        self._ticks += tick
        os.utime(self.path, ns=(0, self._ticks * 4_000_000))

    def replace(self, text: str) -> None:
        """Write beside and rename over, the clean way."""
        beside = self.path.with_suffix(".new")
        beside.write_text(text)
        beside.replace(self.path)


@pytest.fixture
def desk(tmp_path: Path) -> Desk:
    return Desk(tmp_path / "angles.txt")


@pytest.mark.parametrize(
    "line", [b"1.5 -2 3e1", b"1.5,-2,3e1", b" 1.5 , -2 ,\t3e1 \r", b"+1.5\t-2.0   30"]
)
def test_lines_that_count(line: bytes) -> None:
    assert parse_line(line) == (1.5, -2.0, 30.0)


@pytest.mark.parametrize(
    "line", [b"", b"1 2", b"1 2 3 4", b"1 2 x", b"1 2 nan", b"inf 2 3", b"1 2 1e9", b"\xff 2 3"]
)
def test_lines_that_do_not(line: bytes) -> None:
    assert parse_line(line) is None


def test_last_line() -> None:
    assert last_line(b"1\n2\n3", settled=False) == b"2"
    assert last_line(b"1\n2\n3", settled=True) == b"3"
    assert last_line(b"1\n2\n\n \n", settled=False) == b"2"
    assert last_line(b"1", settled=False) is None
    assert last_line(b"", settled=True) is None


def test_a_missing_file_is_waited_for_and_said_to_be_missing(desk: Desk) -> None:
    assert desk.look() is None
    assert "angles.txt: No such file" in desk.file.message
    desk.write("1 2 3\n")
    assert desk.look() == (1, 2, 3)
    desk.path.unlink()
    assert desk.look() is None
    assert "No such file" in desk.file.message
    desk.write("1 2 3\n")
    assert desk.look() == (1, 2, 3)


def test_atomic_replacement(desk: Desk) -> None:
    for angles in ((1, 2, 3), (4, 5, 6), (7, 8, 9)):
        desk.replace("{} {} {}\n".format(*angles))
        assert desk.look() == angles


def test_rewriting_in_place_and_appending(desk: Desk) -> None:
    desk.write("1 2 3\n")
    assert desk.look() == (1, 2, 3)
    desk.write("4 5 6\n")
    assert desk.look() == (4, 5, 6)
    desk.write("7 8 9\n", mode="a")
    assert desk.look() == (7, 8, 9)


def test_a_file_nobody_touches_gives_no_more_poses(desk: Desk) -> None:
    desk.write("1 2 3\n")
    assert [desk.look() for _ in range(5)] == [(1, 2, 3), None, None, None, None]


def test_a_writer_that_repeats_its_numbers_is_alive(desk: Desk) -> None:
    for _ in range(3):
        desk.write("1 2 3\n")
        assert [desk.look(), desk.look(), desk.look()] == [(1, 2, 3), None, None]


@pytest.mark.parametrize("cut", range(1, 9))
def test_a_half_written_line_is_never_taken_for_a_whole_one(desk: Desk, cut: int) -> None:
    line = "12 34 56\n"
    desk.write("1 2 3\n")
    desk.look()
    desk.write(line[:cut], mode="a")
    assert desk.look() in (None, (1, 2, 3)), "at most the last complete line again"
    desk.write(line[cut:], mode="a")
    assert desk.look() == (12, 34, 56)


def test_a_line_without_newline_counts_once_the_file_has_settled(desk: Desk) -> None:
    desk.write("1 2 3")
    assert [desk.look() for _ in range(4)] == [None, (1, 2, 3), None, None]
    desk.write("1 2 3")
    assert [desk.look() for _ in range(3)] == [None, (1, 2, 3), None]


def test_a_moment_of_emptiness_is_not_an_error(desk: Desk) -> None:
    desk.write("1 2 3\n")
    desk.look()
    desk.write("")
    assert desk.look() is None
    assert desk.look() is None
    desk.write("4 5 6\n")
    assert desk.look() == (4, 5, 6)
    assert desk.file.counters.values == {}


def test_two_writes_within_one_tick_of_the_file_systems_clock(desk: Desk) -> None:
    desk.write("1 2 3\n")
    assert desk.look() == (1, 2, 3)
    desk.write("4 5 6\n", tick=False)
    assert desk.look() == (4, 5, 6)


def test_garbage_is_counted_and_named(desk: Desk) -> None:
    desk.write("roll pitch yaw\n")
    assert desk.look() is None
    assert desk.file.counters.values == {"malformed": 1}
    assert "'roll pitch yaw' in degrees" in desk.file.message
    desk.look()
    assert desk.file.counters.values == {"malformed": 1}, "once per change"
    desk.write("1 2 3\n")
    assert desk.look() == (1, 2, 3)
    assert "waiting for" in desk.file.message


def test_a_long_log_is_read_from_its_end(desk: Desk) -> None:
    desk.write("0 0 0\n" * 100_000 + "1 2 3\n")
    assert desk.look() == (1, 2, 3)


def test_what_is_not_an_ordinary_file_is_not_read(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "pipe")
    desk = Desk(tmp_path / "pipe")
    assert desk.look() is None, "and it does not hang"
    assert "not an ordinary file" in desk.file.message


@given(st.lists(st.binary(max_size=30), max_size=6))
def test_any_bytes_harm_nothing(tmp_path: Path, contents: list[bytes]) -> None:
    desk = Desk(tmp_path / "any")
    for content in contents:
        desk.write(content.decode("latin-1"))
        desk.look()
        desk.look()
    desk.write("1 2 3\n")
    assert desk.look() == (1, 2, 3)
