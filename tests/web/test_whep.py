"""A real WebRTC client against the station."""

from __future__ import annotations

import asyncio
import json
import time
from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from aiortc import rtcrtpreceiver
from whep_peer import Bench, Camera, Peer, flown, until

from freelook.clock import now_ns
from freelook.media.annexb import split_nals
from freelook.rotations import body_from_view
from freelook.types import Pose
from freelook.web import whep
from freelook.web.whep import Viewer

Units = list[tuple[int, bytes]]


def only_viewer(station: Bench) -> Viewer:
    [viewer] = station.station.viewers
    assert isinstance(viewer, Viewer)
    return viewer


def has_idr(unit: tuple[int, bytes]) -> bool:
    return any(nal[0] & 31 == 5 for nal in split_nals(unit[1]))


@pytest.fixture
def received(monkeypatch: pytest.MonkeyPatch) -> Units:
    """(RTP time stamp, Annex B) of each coded picture a client got, before decoding."""
    units: Units = []
    make = rtcrtpreceiver.get_decoder

    def tapped(codec: Any) -> Any:
        decoder = make(codec)
        decode = decoder.decode

        def record(unit: Any) -> Any:
            units.append((unit.timestamp, unit.data))
            return decode(unit)

        decoder.decode = record
        return decoder

    monkeypatch.setattr(rtcrtpreceiver, "get_decoder", tapped)
    # browsers report the time stamp on the wire, aiortc one that starts at 0
    monkeypatch.setattr(rtcrtpreceiver.TimestampMapper, "map", lambda self, timestamp: timestamp)
    return units


def test_h264_arrives_untouched_and_decodes(received: Units) -> None:
    async def test(station: Bench) -> None:
        viewer = await station.viewer()
        with Camera(station.source) as camera:
            await until(lambda: len(viewer.frames) > 20, "20 decoded frames")
        await viewer.close()
        sent = [list(split_nals(unit.data)) for unit in camera.sent]
        first = sent.index(list(split_nals(received[0][1])))
        for (_, data), nals in zip(received, sent[first:], strict=False):
            assert list(split_nals(data)) == nals
        assert (viewer.frames[0].width, viewer.frames[0].height) == (320, 320)

    flown(test)


def test_the_page_learns_which_frame_was_captured_when(received: Units) -> None:
    async def test(station: Bench) -> None:
        viewer = await station.viewer()
        with Camera(station.source) as camera:
            await until(lambda: len(viewer.of_type("frame")) > 15, "15 frame messages")
        await viewer.close()
        data_at = dict(received)
        capture_of = {tuple(split_nals(u.data)): u.capture_ns for u in camera.sent}
        messages = [m for m in viewer.of_type("frame") if m["rtp"] in data_at]
        assert len(messages) > 10
        for message in messages:
            assert message["arrival"] == capture_of[tuple(split_nals(data_at[message["rtp"]]))]

    flown(test)


def test_a_newcomer_sees_a_picture_before_the_next_key_picture(received: Units) -> None:
    async def test(station: Bench) -> None:
        camera = Camera(station.source)  # sends only when told to: no key picture will come
        for _ in range(10):
            camera.send()
        viewer = await station.viewer()
        await until(lambda: len(received) >= 9, "the pictures since the last key picture")
        camera.send()
        await until(lambda: len(viewer.frames) >= 9, "decoded pictures")
        assert only_viewer(station).counters["replays"] == 1
        stamps = [stamp for stamp, _ in received]
        assert all(0 < (b - a) % 2**32 < 2**31 for a, b in pairwise(stamps))
        await viewer.close()

    flown(test)


def test_a_lost_picture_is_sent_again(received: Units) -> None:
    async def test(station: Bench) -> None:
        camera = Camera(station.source)
        viewer = await station.viewer()
        for _ in range(4):
            camera.send()
        await until(lambda: len(received) >= 3, "pictures")
        [receiver] = viewer.pc.getReceivers()
        [ssrc] = receiver._RTCRtpReceiver__remote_streams
        for _ in range(5):
            await receiver._send_rtcp_pli(ssrc)
        counters = only_viewer(station).counters
        await until(lambda: counters["pictures_lost"] == 5, "five complaints")
        await until(lambda: counters["sent"] == 8, "the same four pictures")
        assert counters["replays"] == 1
        camera.send()
        await until(lambda: counters["sent"] == 9, "one more")
        await viewer.close()

    flown(test)


def test_poses_arrive_within_milliseconds() -> None:
    async def test(station: Bench) -> None:
        viewer = await station.viewer()
        delays_ms = []
        for yaw in range(40):
            station.trackers["script"].pose(Pose(body_from_view(float(yaw), 0.0), now_ns()))
            seen = len(viewer.of_type("pose"))
            await viewer.more("pose", seen)
            delays_ms.append((now_ns() - viewer.last("pose")["t"]) / 1e6)
        assert np.median(delays_ms) < 20  # with `until` looking every 5 ms
        last = viewer.last("pose")
        assert (last["tracker"], last["state"]) == ("script", "tracking")
        half = np.radians(39 / 2)
        np.testing.assert_allclose(last["q"], [np.cos(half), 0, np.sin(half), 0], atol=1e-12)
        await viewer.close()

    flown(test, "script")


def test_a_silent_tracker_is_told_without_new_poses() -> None:
    async def test(station: Bench) -> None:
        viewer = await station.viewer()
        await until(lambda: viewer.last("pose").get("state") == "waiting", "first state")
        station.trackers["script"].pose(Pose(body_from_view(30.0, 0.0), now_ns()))
        await until(lambda: viewer.last("pose").get("state") == "tracking", "tracking")
        await until(lambda: viewer.last("pose").get("state") == "holding", "holding")
        await until(lambda: viewer.last("pose").get("state") == "easing", "easing")
        count = len(viewer.of_type("pose"))
        await until(lambda: len(viewer.of_type("pose")) > count + 10, "easing at 30 Hz", 2.0)
        await viewer.close()

    flown(test, "script")


def test_ping_is_answered_with_the_stations_clock() -> None:
    async def test(station: Bench) -> None:
        viewer = await station.viewer()
        before = now_ns()
        viewer.channel.send('{"type":"ping","t":1234.5}')
        pong = await until(lambda: viewer.last("pong"), "pong")
        assert pong["t"] == 1234.5
        assert before <= pong["ns"] <= now_ns()
        await viewer.close()

    flown(test)


HOSTILE: list[str | bytes] = [
    "",
    "{",
    "null",
    "[]",
    "[" * 900,
    "x" * 5000,
    b"\x00\xff\xfe",
    '{"type":"ping"}',
    '{"type":"ping","t":NaN}',
    '{"type":"ping","t":1e999}',
    '{"type":"ping","t":true}',
    '{"type":"ping","t":"1"}',
    '{"type":"ping","t":' + "9" * 900 + "}",
    '{"type":["ping"],"t":1}',
    '{"type":"pose","q":[1,0,0,0]}',
]


def test_hostile_messages_are_counted_and_the_rest_goes_on() -> None:
    async def test(station: Bench) -> None:
        viewer = await station.viewer()
        counters = only_viewer(station).counters
        for message in HOSTILE:
            viewer.channel.send(message)
            await asyncio.sleep(0.005)  # unreliable channel: do not overrun it
        await until(lambda: counters["messages_not_understood"] == len(HOSTILE), "all counted")
        assert viewer.of_type("pong") == []
        viewer.channel.send('{"type":"ping","t":1}')
        await until(lambda: viewer.last("pong"), "pong after all that")
        await viewer.close()

    flown(test)


def test_only_the_channel_called_head_is_listened_to() -> None:
    async def test(station: Bench) -> None:
        viewer = await station.viewer()
        other = viewer.pc.createDataChannel("other")
        await until(lambda: other.readyState == "open", "second channel")
        other.send('{"type":"ping","t":1}')
        await until(lambda: only_viewer(station).counters["unknown_channels"], "count")
        viewer.channel.send('{"type":"ping","t":2}')
        await until(lambda: viewer.of_type("pong"), "pong")
        assert [m["t"] for m in viewer.of_type("pong")] == [2]
        await viewer.close()

    flown(test)


def test_a_full_channel_is_skipped_and_counted() -> None:
    async def test(station: Bench) -> None:
        peer = await station.viewer()
        viewer = only_viewer(station)
        sent = [viewer.send(json.dumps({"type": "fill", "x": "y" * 4000})) for _ in range(20)]
        assert sent.index(False) <= 5
        assert viewer.counters["messages_skipped"] == sent.count(False)
        await until(lambda: viewer.send('{"type":"after"}'), "room again")
        counters = station.station.status()["source"]["counters"]
        assert counters["viewers_messages_skipped"] == viewer.counters["messages_skipped"]
        await peer.close()

    flown(test)


def test_a_pose_that_found_the_channel_full_comes_later() -> None:
    async def test(station: Bench) -> None:
        peer = await station.viewer()
        await until(lambda: peer.last("pose"), "first pose")
        while only_viewer(station).send(json.dumps({"type": "fill", "x": "y" * 4000})):
            pass
        station.station.control("script", "disable")
        await until(lambda: peer.last("pose")["state"] == "disabled", "the pose")
        await peer.close()

    flown(test, "script")


def test_status_comes_four_times_a_second() -> None:
    async def test(station: Bench) -> None:
        viewer = await station.viewer()
        start = time.monotonic()
        await until(lambda: len(viewer.of_type("status")) >= 5, "5 status messages", 3.0)
        assert 0.5 < time.monotonic() - start < 2.5
        status = viewer.last("status")
        assert status["viewers"] == 1
        assert status["trackers"][0]["name"] == "script"
        assert status["source"]["state"] == "connecting"
        await viewer.close()

    flown(test, "script")


def test_several_viewers_get_the_same_pictures_and_leave_one_by_one() -> None:
    async def test(station: Bench) -> None:
        viewers = [await station.viewer() for _ in range(4)]
        with Camera(station.source):
            await until(lambda: all(len(v.frames) > 5 for v in viewers), "pictures for all", 20.0)
            await viewers[0].close()
            await until(lambda: len(station.station.viewers) == 3, "one viewer less")
            async with station.http.delete(station.base + viewers[1].location) as reply:
                assert reply.status == 200
            await until(lambda: len(station.station.viewers) == 2, "two viewers less")
            count = len(viewers[2].frames)
            await until(lambda: len(viewers[2].frames) > count + 5, "pictures for the rest")
        for viewer in viewers:
            await viewer.close()

    flown(test)


def test_an_offer_without_a_viewer_is_forgotten(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(whep, "CONNECT_S", 0.2)

    async def test(station: Bench) -> None:
        peer = Peer(station.http, station.base)
        offer = await peer.offer()
        await station.station.viewers.add(offer)
        assert len(station.station.viewers) == 1
        await until(lambda: len(station.station.viewers) == 0, "forgotten")
        await peer.close()

    flown(test)


def test_h265_is_transcoded_says_so_and_only_while_somebody_watches() -> None:
    async def test(station: Bench) -> None:
        with Camera(station.source, codec="h265"):
            viewer = await station.viewer()
            await until(lambda: len(viewer.frames) > 5, "transcoded pictures", 20.0)
            status = await until(
                lambda: (s := viewer.last("status")["source"])["transcoding"] and s, "reason"
            )
            assert "H.265" in status["transcoding"]
            assert status["codec"] == "hevc"
            assert viewer.of_type("frame")
            await viewer.close()
            counters = station.station._feed.counters
            await until(lambda: not len(station.station.viewers), "nobody watching")
            count = await until(lambda: counters["transcoded"], "count")
            await asyncio.sleep(0.3)
            assert counters["transcoded"] <= count + 1
            viewer = await station.viewer()
            await until(lambda: len(viewer.frames) > 5, "pictures again", 20.0)
            await viewer.close()

    flown(test)


def test_a_lost_picture_of_transcoded_video_makes_a_key_picture(received: Units) -> None:
    async def test(station: Bench) -> None:
        with Camera(station.source, codec="h265"):
            viewer = await station.viewer()
            await until(lambda: len(received) > 3, "pictures", 20.0)
            [receiver] = viewer.pc.getReceivers()
            [ssrc] = receiver._RTCRtpReceiver__remote_streams
            count = len(received)
            await receiver._send_rtcp_pli(ssrc)
            await until(lambda: any(map(has_idr, received[count : count + 10])), "key picture")
            assert only_viewer(station).counters["replays"] <= 1
            await viewer.close()

    flown(test)


def test_a_source_that_is_lost_comes_back_to_the_same_viewer() -> None:
    async def test(station: Bench) -> None:
        viewer = await station.viewer()
        with Camera(station.source):
            await until(lambda: len(viewer.frames) > 5, "pictures")
        station.source.fail("somebody pulled the plug")
        await until(lambda: len(station.sources) == 2, "opened again")
        count = len(viewer.frames)
        with Camera(station.source):
            await until(lambda: len(viewer.frames) > count + 5, "pictures again")
        await viewer.close()

    flown(test)


def test_the_viewer_hears_why_there_is_no_video() -> None:
    async def test(station: Bench) -> None:
        viewer = await station.viewer()
        Camera(station.source).send()
        await until(lambda: viewer.last("status"), "the first status")
        await until(lambda: viewer.last("status")["source"]["state"] == "live", "live")
        await until(lambda: viewer.last("status")["source"]["state"] == "lost", "lost")
        source = viewer.last("status")["source"]
        assert "no picture for" in source["message"]
        assert source["age_ms"] > 1000
        await viewer.close()

    flown(test)
