from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from freelook.axes import AXES, Axis, AxisMap, parse_axes
from freelook.errors import TrackerError
from freelook.rotations import angle_between_deg, body_from_view, head_angles_deg


def test_without_words_everything_stays() -> None:
    assert AxisMap()(10, 20, 30) == (10, 20, 30)
    assert parse_axes({}) == AxisMap()


@pytest.mark.parametrize(
    ("terms", "expected"),
    [
        ({"yaw": "-yaw"}, (-10, 20, 30)),
        ({"yaw": "+yaw"}, (10, 20, 30)),
        ({"pitch": "roll*0.5"}, (10, 15, 30)),
        ({"pitch": "-roll*2"}, (10, -60, 30)),
        ({"roll": "0"}, (10, 20, 0)),
        ({"yaw": "pitch", "pitch": "yaw"}, (20, 10, 30)),
        ({"yaw": " -roll*.25 "}, (-7.5, 20, 30)),
    ],
)
def test_swap_sign_and_scale(terms: dict[str, str], expected: tuple[float, float, float]) -> None:
    assert parse_axes(terms)(10, 20, 30) == expected


def test_axes_not_named_keep_the_trackers_default() -> None:
    default = AxisMap(roll=Axis("roll", -1))
    assert parse_axes({"yaw": "-yaw"}, default)(10, 20, 30) == (-10, 20, -30)
    assert parse_axes({"roll": "roll"}, default)(10, 20, 30) == (10, 20, 30)


@pytest.mark.parametrize(
    "text", ["", "yaw*", "-", "2", "yaw*-1", "tilt", "yaw+roll", "yaw*nan", "1e3*yaw", "yaw*1e3"]
)
def test_text_that_is_not_understood_lists_what_is(text: str) -> None:
    with pytest.raises(TrackerError, match=r"yaw=.*write 0, or one of yaw, pitch, roll, .*yaw\*0"):
        parse_axes({"yaw": text})


def test_unknown_axis_and_absurd_factor() -> None:
    with pytest.raises(TrackerError, match="unknown axis 'heading'; known: yaw, pitch, roll"):
        parse_axes({"heading": "yaw"})
    with pytest.raises(TrackerError, match="at most 100"):
        parse_axes({"yaw": "yaw*1000"})


def test_a_rotation_is_remapped_by_its_angles() -> None:
    axes = parse_axes({"yaw": "-yaw", "roll": "0"})
    assert head_angles_deg(axes.remap(body_from_view(10, 20, 30))) == pytest.approx((-10, 20, 0))
    same = body_from_view(10, 20, 30)
    assert AxisMap().remap(same) is same


@pytest.mark.parametrize("angle", [float("nan"), float("inf"), 1e300, -36_001.0])
def test_angles_no_head_can_have_are_refused(angle: float) -> None:
    with pytest.raises(ValueError, match="not an angle a head can have"):
        AxisMap().body_from_view(0, angle, 0)


@given(st.sampled_from(AXES), st.text(max_size=12) | st.from_regex(r"[-+]?(yaw|roll)\*[\d.]+"))
def test_any_text_is_a_map_or_an_error(axis: str, text: str) -> None:
    try:
        axes = parse_axes({axis: text})
    except TrackerError:
        return
    axes(1, 2, 3)


@given(st.floats(-36_000, 36_000), st.floats(-36_000, 36_000), st.floats(-36_000, 36_000))
def test_any_angle_is_a_rotation(yaw: float, pitch: float, roll: float) -> None:
    rotation = AxisMap().body_from_view(yaw, pitch, roll)
    turned = AxisMap().body_from_view(yaw % 360, pitch % 360, roll % 360)
    assert angle_between_deg(rotation, turned) < 1e-5
