from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from freelook.axes import AxisMap
from freelook.errors import TrackerError
from freelook.rotations import head_angles_deg
from freelook.trackers import open_tracker
from freelook.trackers._frames import rdf_from_axes
from freelook.trackers.csvline import LineDecoder

ANGLES = ("yaw", "pitch", "roll")
QUATERNION = ("qw", "qx", "qy", "qz")


def decoder(
    columns: tuple[str, ...] = ANGLES, degrees: float = 1.0, frame: str = "rdf"
) -> LineDecoder:
    return LineDecoder(columns, degrees, rdf_from_axes(frame, "frame"), AxisMap())


def angles(made: LineDecoder, text: str) -> list[object]:
    rotations = made.feed(f"\n{text}\n".encode(), 0)
    return [pytest.approx(head_angles_deg(rotation), abs=1e-4) for rotation in rotations]


def test_columns_in_any_order() -> None:
    assert angles(decoder(("roll", "-", "yaw")), "10 x 30") == [(30, 0, 10)]


def test_radians() -> None:
    assert angles(decoder(degrees=57.29577951308232), "0.5235988,0,0") == [(30, 0, 0)]


@pytest.mark.parametrize(
    ("frame", "right", "up", "right_ear_down"),
    [
        ("rdf", "y", "x", "z"),
        ("frd", "z", "y", "x"),
        ("flu", "-z", "-y", "x"),
        ("rfu", "-z", "x", "y"),
    ],
)
def test_quaternions_of_other_axes(frame: str, right: str, up: str, right_ear_down: str) -> None:
    """Each movement is a right-handed turn about one of the sensor's own axes: right about what
    points down, up about what points right, right ear down about what points forward."""
    for axis, expected in ((right, (20, 0, 0)), (up, (0, 20, 0)), (right_ear_down, (0, 0, 20))):
        turn = -20 if axis.startswith("-") else 20
        x, y, z, w = Rotation.from_euler(axis[-1], turn, degrees=True).as_quat()
        assert angles(decoder(QUATERNION, frame=frame), f"{w},{x},{y},{z}") == [expected]


@pytest.mark.parametrize("line", ["0,0,0,0", "2,0,0,0", "1,0,0", "nan,0,0,1", "1e300,1e300,0,0"])
def test_quaternions_that_are_none_are_counted(line: str) -> None:
    made = decoder(QUATERNION)
    assert angles(made, line) == []
    assert made.counters["invalid"] == 1


def test_absurd_angles_are_counted() -> None:
    made = decoder()
    assert angles(made, "1,2,3\n36001,0,0\n4,5,6") == [(1, 2, 3), (4, 5, 6)]
    assert made.counters["invalid"] == 1


line_like = st.text("0123456789.,-+e \n", max_size=200).map(str.encode)


@given(
    st.lists(st.binary(max_size=60) | line_like, max_size=10), st.sampled_from([ANGLES, QUATERNION])
)
def test_any_bytes_cut_anywhere(pieces: list[bytes], columns: tuple[str, ...]) -> None:
    whole, parts = decoder(columns), decoder(columns)
    expected = len(whole.feed(b"".join(pieces), 0))
    assert sum(len(parts.feed(piece, 0)) for piece in pieces) == expected
    assert parts.counters == whole.counters


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ("columns=yaw,qw", "give yaw, pitch, roll or qw, qx, qy, qz"),
        ("columns=-", "give yaw, pitch, roll or"),
        ("columns=qw,qx,qy", "give yaw, pitch, roll or"),
        ("columns=heading", "'heading' is not a column"),
        ("unit=grad", "unit must be one of deg, rad, not 'grad'"),
        ("frame=xyz", "frame=xyz is not three of"),
    ],
)
def test_options_are_checked(options: str, words: str) -> None:
    with pytest.raises(TrackerError, match=words):
        open_tracker(f"csv:/dev/ttyACM0?{options}")
