"""The time stamp drawn into pictures."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from freelook.latency import BITS, BLOCK_PX, draw_stamp, read_stamp, stamp_rows

TIMES_NS = st.integers(0, (1 << 48) - 1).map(lambda us: us * 1000)


@given(TIMES_NS, st.sampled_from([(16, 960), (16, 896), (64, 320), (896, 16)]))
def test_what_is_drawn_is_read(time_ns: int, shape: tuple[int, int]) -> None:
    luma = np.full(shape, 128, np.uint8)
    draw_stamp(luma, time_ns + 999)
    assert read_stamp(luma) == time_ns


@given(TIMES_NS, st.integers(0, BITS - 1))
def test_one_wrong_bit_is_not_a_time(time_ns: int, bit: int) -> None:
    luma = np.zeros((16, 960), np.uint8)
    draw_stamp(luma, time_ns)
    block = luma[:, bit * BLOCK_PX : (bit + 1) * BLOCK_PX]
    block[:] = 248 - block
    assert read_stamp(luma) is None


@given(TIMES_NS, TIMES_NS)
def test_half_of_one_and_half_of_another_is_not_a_time(first_ns: int, second_ns: int) -> None:
    """A picture torn between two frames shows one of them, or nothing."""
    luma, other = np.zeros((2, 16, 960), np.uint8)
    draw_stamp(luma, first_ns)
    draw_stamp(other, second_ns)
    luma[8:] = other[8:]
    assert read_stamp(luma) in (None, first_ns, second_ns)


@pytest.mark.parametrize("level", [0, 16, 128, 235, 255])
def test_pictures_without_a_stamp(level: int, rng: np.random.Generator) -> None:
    assert read_stamp(np.full((64, 960), level, np.uint8)) is None
    assert read_stamp(rng.integers(0, 256, (64, 960), dtype=np.uint8)) is None


def test_too_small_a_picture_is_refused() -> None:
    assert stamp_rows(320) == 48
    for shape in ((47, 320), (400, 15)):
        with pytest.raises(ValueError, match="too small"):
            draw_stamp(np.zeros(shape, np.uint8), 0)
