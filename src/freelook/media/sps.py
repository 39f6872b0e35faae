"""What a sequence parameter set says: size, colour format, picture order (H.264, H.265)."""

from __future__ import annotations

from dataclasses import dataclass

from ..types import StreamInfo
from .bits import BitReader

_HIGH_PROFILES = {100, 110, 122, 244, 44, 83, 86, 118, 128, 138, 139, 134, 135}
_CHROMA = ("4:0:0", "4:2:0", "4:2:2", "4:4:4")
_EXTENDED_ASPECT = 255


@dataclass(frozen=True, slots=True)
class SpsInfo:
    """`reorder_frames`: how many pictures may be shown after later coded ones; None: unknown."""

    width: int
    height: int
    chroma: str = "4:2:0"
    bit_depth: int = 8
    interlaced: bool = False
    full_range: bool = False
    reorder_frames: int | None = None

    @property
    def pixel_format(self) -> str | None:
        """FFmpeg's name of the format, for what freelook meets; None for others."""
        if self.bit_depth != 8:
            return None
        if self.chroma == "4:0:0":
            return "gray"
        return ("yuvj" if self.full_range else "yuv") + self.chroma.replace(":", "") + "p"


def parse_sps(codec: str, nal: bytes) -> SpsInfo | None:
    """Read an SPS of codec h264 or hevc; None when it is damaged."""
    try:
        info = _h264(nal) if codec == "h264" else _h265(nal)
    except ValueError:
        return None
    return info if 0 < info.width <= 16384 and 0 < info.height <= 16384 else None


def stream_info(codec: str, sps: bytes | None) -> StreamInfo:
    """What an SPS tells about its stream; without one, or with a damaged one, only the codec."""
    info = parse_sps(codec, sps) if sps else None
    if info is None:
        return StreamInfo(codec)
    return StreamInfo(codec, info.width, info.height, info.pixel_format)


def _h264(nal: bytes) -> SpsInfo:
    """ITU-T H.264, clause 7.3.2.1.1."""
    bits = BitReader(nal, header_bytes=1)
    profile, constraints = bits.u(8), bits.u(8)
    bits.u(8)  # level
    bits.ue()  # id
    chroma, depth = _h264_color_format(bits) if profile in _HIGH_PROFILES else (1, 8)
    bits.ue()  # log2_max_frame_num
    order_type = _h264_picture_order(bits)
    bits.ue()  # max_num_ref_frames
    bits.flag()
    columns, rows = bits.ue() + 1, bits.ue() + 1
    progressive = bits.flag()
    if not progressive:
        bits.flag()
        rows *= 2
    bits.flag()
    left, right, top, bottom = [bits.ue() for _ in range(4)] if bits.flag() else [0] * 4
    step_x = 2 if chroma in (1, 2) else 1
    step_y = (2 if chroma == 1 else 1) * (1 if progressive else 2)
    size = 16 * columns - step_x * (left + right), 16 * rows - step_y * (top + bottom)
    full_range, reorder = _h264_vui(bits) if bits.flag() else (False, None)
    intra_only = constraints & 0x10 and profile in (44, 86, 100, 110, 122, 244)
    if order_type == 2 or profile == 66 or intra_only:
        reorder = 0
    return SpsInfo(*size, _CHROMA[chroma], depth, not progressive, full_range, reorder)


def _h264_color_format(bits: BitReader) -> tuple[int, int]:
    chroma = bits.ue()
    if chroma > 3:
        raise ValueError("chroma_format_idc")
    if chroma == 3:
        bits.flag()
    depth = 8 + max(bits.ue(), bits.ue())
    bits.flag()
    if bits.flag():
        for i in range(12 if chroma == 3 else 8):
            if bits.flag():
                _skip_scaling_list(bits, 16 if i < 6 else 64)
    return chroma, depth


def _skip_scaling_list(bits: BitReader, size: int) -> None:
    last = following = 8
    for _ in range(size):
        if following:
            following = (last + bits.se()) % 256
        last = following or last


def _h264_picture_order(bits: BitReader) -> int:
    kind = bits.ue()
    if kind == 0:
        bits.ue()
    elif kind == 1:
        bits.flag()
        bits.se()
        bits.se()
        for _ in range(min(bits.ue(), 255)):
            bits.se()
    return kind


def _h264_vui(bits: BitReader) -> tuple[bool, int | None]:
    """Clause E.1.1: (full range, max_num_reorder_frames or None)."""
    if bits.flag() and bits.u(8) == _EXTENDED_ASPECT:
        bits.u(32)
    if bits.flag():
        bits.flag()
    full_range = _video_signal(bits)
    if bits.flag():
        bits.ue()
        bits.ue()
    if bits.flag():
        bits.u(65)  # timing
    nal_hrd = _skip_hrd(bits)
    vcl_hrd = _skip_hrd(bits)
    if nal_hrd or vcl_hrd:
        bits.flag()
    bits.flag()
    if not bits.flag():
        return full_range, None
    bits.flag()
    for _ in range(4):
        bits.ue()
    return full_range, bits.ue()


def _video_signal(bits: BitReader) -> bool:
    if not bits.flag():
        return False
    bits.u(3)
    full_range = bits.flag()
    if bits.flag():
        bits.u(24)
    return full_range


def _skip_hrd(bits: BitReader) -> bool:
    if not bits.flag():
        return False
    count = bits.ue() + 1
    if count > 32:
        raise ValueError("cpb_cnt_minus1")
    bits.u(8)
    for _ in range(count):
        bits.ue()
        bits.ue()
        bits.flag()
    bits.u(20)
    return True


def _h265(nal: bytes) -> SpsInfo:
    """ITU-T H.265, clause 7.3.2.2.1, as far as the bit depths."""
    bits = BitReader(nal, header_bytes=2)
    bits.u(4)
    sub_layers = bits.u(3)
    bits.flag()
    _skip_profile_tier_level(bits, sub_layers)
    bits.ue()  # id
    chroma = bits.ue()
    if chroma > 3:
        raise ValueError("chroma_format_idc")
    if chroma == 3:
        bits.flag()
    width, height = bits.ue(), bits.ue()
    left, right, top, bottom = [bits.ue() for _ in range(4)] if bits.flag() else [0] * 4
    width -= (2 if chroma in (1, 2) else 1) * (left + right)
    height -= (2 if chroma == 1 else 1) * (top + bottom)
    depth = 8 + max(bits.ue(), bits.ue())
    return SpsInfo(width, height, _CHROMA[chroma], depth)


def _skip_profile_tier_level(bits: BitReader, sub_layers: int) -> None:
    bits.u(96)
    present = [(bits.flag(), bits.flag()) for _ in range(sub_layers)]
    if sub_layers:
        bits.u(2 * (8 - sub_layers))
    for profile, level in present:
        bits.u(88 * profile + 8 * level)
