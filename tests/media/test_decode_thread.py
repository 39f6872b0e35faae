from __future__ import annotations

import threading
from collections.abc import Callable, Iterator
from typing import Any

import pytest

from freelook.media.annexb import is_key, join_nals, split_nals
from freelook.media.decode_thread import DecodeThread
from freelook.media.rtp_video import RtpVideo
from freelook.types import AccessUnit, Counters, StreamInfo
from video_streams import GOP, rtp_datagrams

PICTURES = 2 * GOP


@pytest.fixture
def thread() -> Iterator[DecodeThread]:
    decoding = DecodeThread()
    decoding.start()
    yield decoding
    decoding.close()


def units() -> list[AccessUnit]:
    video = RtpVideo(Counters())
    return [u for i, d in enumerate(rtp_datagrams("h264")) for u in video.push(d, i)]


def total(decoding: DecodeThread, name: str) -> int:
    return sum(counters[name] for counters in decoding.counters())


def test_everyone_gets_the_newest_frame(
    thread: DecodeThread, wait_until: Callable[..., None]
) -> None:
    boxes = [thread.add(), thread.add()]
    for i, unit in enumerate(units()):
        thread.put(unit)
        wait_until(lambda i=i: total(thread, "decoded") == i + 1)
    wait_until(lambda: all(box.received == PICTURES for box in boxes))
    for box in boxes:
        frame = box.take()
        assert frame is not None
        assert frame.capture_ns == units()[-1].capture_ns
    assert total(thread, "dropped_frames") == 2 * (PICTURES - 1)
    assert thread.size == (160, 120)


def test_nothing_is_decoded_for_nobody(thread: DecodeThread) -> None:
    box = thread.add()
    thread.remove(box)
    for unit in units():
        thread.put(unit)
    thread.finish()
    assert box.closed
    assert total(thread, "decoded") == 0


def test_joining_late_begins_with_a_key(
    thread: DecodeThread, wait_until: Callable[..., None]
) -> None:
    box = thread.add()
    for unit in units()[3:]:
        thread.put(unit)
    wait_until(lambda: box.received == 1 or total(thread, "decoded") >= 1)
    assert total(thread, "skipped") >= GOP - 3


def test_a_decoder_that_cannot_keep_up_loses_pictures_not_time() -> None:
    decoding = DecodeThread()  # not started: as slow as can be
    decoding.add()
    for unit in units() * 10:
        decoding.put(unit)
    assert total(decoding, "skipped") >= 10 * PICTURES - 2 * GOP
    decoding.close()


def test_a_stream_that_never_sends_a_key_is_tried_in_the_end() -> None:
    decoding = DecodeThread()
    decoding.add()
    plain = next(u for u in units() if not u.key)
    for _ in range(300):
        decoding.put(plain)
    assert total(decoding, "skipped") == 299
    decoding.close()


def test_a_codec_that_cannot_be_decoded_is_said(
    thread: DecodeThread, wait_until: Callable[..., None]
) -> None:
    thread.add()
    thread.put(AccessUnit(StreamInfo("nonsense"), b"x", True, 0))
    wait_until(lambda: thread.complaint)
    assert "no decoder for 'nonsense'" in thread.complaint
    for unit in units():
        thread.put(unit)
        break
    wait_until(lambda: total(thread, "decoded") == 1)


def test_close_wakes_whoever_waits(thread: DecodeThread) -> None:
    box = thread.add()
    got: list[Any] = []
    waiter = threading.Thread(target=lambda: got.append(box.take(60)))
    waiter.start()
    thread.close()
    waiter.join(5)
    assert got == [None]
    assert thread.add().closed


def test_annexb_helpers_agree_with_each_other() -> None:
    for unit in units():
        nals = list(split_nals(unit.data))
        assert join_nals(nals) == unit.data
        assert is_key("h264", nals) == unit.key
