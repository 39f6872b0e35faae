"""A time drawn into the picture, for measuring latency through anything that shows pictures.

The stamp is 48 bits of microseconds of the monotonic clock and 8 check bits, drawn as 16x16
blocks of dark and bright luma, least significant bit first, in the top left corner: one row in
pictures at least 896 pixels wide, more rows in narrower ones. It survives hard compression; a
damaged stamp fails its check and is not read as a time.
"""

from __future__ import annotations

from .types import Plane

BLOCK_PX = 16
TIME_BITS = 48
CHECK_BITS = 8
BITS = TIME_BITS + CHECK_BITS
DARK, BRIGHT = 32, 216
NS_PER_US = 1000


def stamp_rows(width: int) -> int:
    """How many rows of pixels the stamp covers in a picture this wide (at least 16 pixels)."""
    return -(-BITS // (width // BLOCK_PX)) * BLOCK_PX


def draw_stamp(luma: Plane, time_ns: int) -> None:
    """Draw a time into a luma plane (rows, columns), in place, cut to whole microseconds.

    ValueError when the plane is too small to hold it.
    """
    time_us = time_ns // NS_PER_US % (1 << TIME_BITS)
    word = time_us | check_bits(time_us) << TIME_BITS
    for bit, block in enumerate(_blocks(luma)):
        block[:] = BRIGHT if word >> bit & 1 else DARK


def read_stamp(luma: Plane) -> int | None:
    """The time drawn into a luma plane in nanoseconds; None where there is no whole stamp."""
    word = 0
    for bit, block in enumerate(_blocks(luma)):
        level = float(block[4:12, 4:12].mean())
        if abs(level - (DARK + BRIGHT) / 2) < (BRIGHT - DARK) / 6:
            return None  # neither dark nor bright: not a stamp, or half of two
        word |= (level > (DARK + BRIGHT) / 2) << bit
    return time_of(word)


def time_of(word: int) -> int | None:
    """The time in a stamp's 56 bits in nanoseconds; None for damaged ones."""
    time_us = word & ((1 << TIME_BITS) - 1)
    return time_us * NS_PER_US if word >> TIME_BITS == check_bits(time_us) else None


def check_bits(time_us: int) -> int:
    """CRC-8 (polynomial 0x07, start 0x5A, so that an all-dark picture is not a time)."""
    crc = 0x5A
    for byte in time_us.to_bytes(TIME_BITS // 8, "little"):
        crc ^= byte
        for _ in range(8):
            crc = crc << 1 ^ (0x107 if crc & 0x80 else 0)
    return crc


def _blocks(luma: Plane) -> list[Plane]:
    rows, columns = luma.shape
    across = columns // BLOCK_PX
    if not across or stamp_rows(columns) > rows:
        raise ValueError(f"a picture of {columns} x {rows} pixels is too small for a time stamp")
    corners = ((bit // across * BLOCK_PX, bit % across * BLOCK_PX) for bit in range(BITS))
    return [luma[y : y + BLOCK_PX, x : x + BLOCK_PX] for y, x in corners]
