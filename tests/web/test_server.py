"""HTTP of the station: every answer that is not the page, and why."""

from __future__ import annotations

import json
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from whep_peer import Bench, Camera, Peer, flown, until

from freelook.outputs.runner import OutputStatus
from freelook.web import messages
from freelook.web.security import Guard

SDP = {"Content-Type": "application/sdp"}
JSON = {"Content-Type": "application/json"}


async def ask(station: Bench, method: str, path: str, **options: Any) -> tuple[int, str, Any]:
    async with station.http.request(method, station.base + path, **options) as reply:
        return reply.status, await reply.text(), reply.headers


async def offer(station: Bench) -> str:
    peer = Peer(station.http, station.base)
    try:
        return await peer.offer()
    finally:
        await peer.close()


def test_station_describes_its_camera() -> None:
    async def test(station: Bench) -> None:
        async with station.http.get(station.base + "/api/station") as reply:
            about = await reply.json()
        assert about["source"] == "rtsp://camera/scripted"  # viewers need no camera's password
        assert about["trackers"] == ["script"]
        assert about["camera"]["size"] == [960, 960]
        assert len(about["camera"]["g"]) == 256
        assert about["camera"]["camera_from_head"] == [[1, 0, 0], [0, 1, 0], [0, 0, 1]]
        assert about["modes"] == ["body", "horizon", "world", "follow", "point"]
        assert about["zoom"]["narrowest_deg"] == 10
        assert about["zoom"]["focal_px"] > 1000

    flown(test, "script")


def test_the_page_is_never_stored_and_may_load_nothing_foreign() -> None:
    async def test(station: Bench) -> None:
        status, text, headers = await ask(station, "GET", "/")
        assert (status, headers["Cache-Control"]) == (200, "no-store")
        assert "<html" in text
        assert "default-src 'none'" in headers["Content-Security-Policy"]

    flown(test)


@pytest.mark.parametrize(
    ("address", "word"),
    [("view.glsl", "t_max"), ("pen.glsl", "half_width"), ("hud.json", "themes")],
)
def test_shaders_and_hud_are_those_of_this_side(address: str, word: str) -> None:
    async def test(station: Bench) -> None:
        status, text, _ = await ask(station, "GET", f"/{address}")
        assert status == 200
        assert not text.lstrip().startswith("#version")
        assert word in text

    flown(test)


def test_the_page_learns_of_attitude_and_recordings() -> None:
    turned = Rotation.from_euler("ZYX", [90, 0, 0], degrees=True)  # the vehicle heads east
    told = json.loads(messages.frame(7, 3, world_from_body=turned))
    # in a head's axes, y down: to the right
    assert told["world"] == pytest.approx([np.sqrt(0.5), 0, np.sqrt(0.5), 0], abs=1e-6)
    assert "world" not in json.loads(messages.frame(7, 3))
    output = OutputStatus("file:a.mp4", "live", "", 30.0, {"shown": 12})
    expected = {"name": "file:a.mp4", "state": "live", "message": "", "shown": 12}
    assert messages.recording(output) == expected
    assert messages.status({}, [], 0, None, [expected])["recordings"] == [expected]


@pytest.mark.parametrize("path", ["/static/../server.py", "/static/%2e%2e/server.py", "/nothing"])
def test_only_files_of_the_page_are_served(path: str) -> None:
    async def test(station: Bench) -> None:
        status, text, _ = await ask(station, "GET", path)
        assert status in (403, 404)
        assert "import" not in text

    flown(test)


def test_whep_session_from_offer_to_delete() -> None:
    async def test(station: Bench) -> None:
        status, answer, headers = await ask(
            station, "POST", "/whep", data=await offer(station), headers=SDP
        )
        assert (status, headers["Content-Type"]) == (201, "application/sdp")
        assert "H264/90000" in answer
        assert "VP8" not in answer
        assert "a=sendonly" in answer
        location = headers["Location"]
        assert (await ask(station, "DELETE", location))[0] == 200
        assert len(station.station.viewers) == 0
        status, text, _ = await ask(station, "DELETE", location)
        assert (status, "no such session" in text) == (404, True)

    flown(test)


def test_whep_says_what_it_takes() -> None:
    async def test(station: Bench) -> None:
        status, _, headers = await ask(station, "OPTIONS", "/whep")
        assert (status, headers["Accept-Post"]) == (204, "application/sdp")

    flown(test)


@pytest.mark.parametrize(
    ("change", "status", "why"),
    [
        (lambda sdp: "", 400, "no video"),
        (lambda sdp: "v=0\r\nhello", 400, "no video"),
        (lambda sdp: "m=video x y z\r\n" + sdp, 400, "not an SDP offer"),
        (lambda sdp: sdp.replace("m=video", "m=audio"), 400, "no video"),
        (lambda sdp: sdp.replace("a=recvonly", "a=sendonly"), 400, "must be recvonly"),
        (lambda sdp: sdp.replace("H264", "H265"), 406, "only H.264"),
        (lambda sdp: sdp.replace("mode=1", "mode=0"), 406, "no codec in common"),
        (lambda sdp: sdp.replace("a=ice-ufrag", "a=ice-cream"), 400, "cannot be answered"),
        (lambda sdp: sdp + "a=x\r\n" * 20000, 413, "larger than"),
        (lambda sdp: b"\xff\xfe\x00", 400, "not UTF-8"),
    ],
)
def test_offers_that_cannot_be_taken(change: Any, status: int, why: str) -> None:
    async def test(station: Bench) -> None:
        data = change(await offer(station))
        got, text, _ = await ask(station, "POST", "/whep", data=data, headers=SDP)
        assert (got, why in text) == (status, True), text
        assert len(station.station.viewers) == 0

    flown(test)


def test_wrong_content_type_and_wrong_method() -> None:
    async def test(station: Bench) -> None:
        status, text, _ = await ask(station, "POST", "/whep", data="v=0", headers=JSON)
        assert (status, "application/sdp" in text) == (415, True)
        status, text, headers = await ask(station, "PATCH", "/whep/some")
        assert (status, "trickle" in text) == (405, True)
        assert "DELETE" in headers["Allow"]
        assert (await ask(station, "GET", "/whep"))[0] == 405

    flown(test)


def test_too_many_viewers_are_told_to_come_back() -> None:
    async def test(station: Bench) -> None:
        sdp = await offer(station)
        assert (await ask(station, "POST", "/whep", data=sdp, headers=SDP))[0] == 201
        status, text, headers = await ask(station, "POST", "/whep", data=sdp, headers=SDP)
        assert (status, "1 viewers" in text) == (503, True)
        assert int(headers["Retry-After"]) > 0

    flown(test, most_viewers=1)


@pytest.mark.parametrize(
    ("body", "status", "why"),
    [
        ('{"tracker":"script","action":"recentre"}', 204, ""),
        ('{"tracker":"script","action":"disable"}', 204, ""),
        ('{"tracker":"script","action":"eyes_front"}', 204, ""),
        ('{"tracker":"other","action":"enable"}', 404, "known: script"),
        ('{"tracker":"script","action":"close"}', 400, "recentre, enable, disable"),
        ('{"tracker":"script"}', 400, "tracker"),
        ('["script","enable"]', 400, "object"),
        ('{"tracker":["script"],"action":{}}', 400, "texts"),
        ("{", 400, "not JSON"),
        ("[" * 60000, 400, "not JSON"),
    ],
)
def test_control(body: str, status: int, why: str) -> None:
    async def test(station: Bench) -> None:
        got, text, _ = await ask(station, "POST", "/api/control", data=body, headers=JSON)
        assert (got, why in text) == (status, True), text

    flown(test, "script")


def test_modes_are_chosen_for_everybody_and_told() -> None:
    async def test(station: Bench) -> None:
        for mode, status, why in (
            ("horizon", 204, ""),
            ("up", 400, "known: body, horizon, world, follow, point"),
            ("point", 409, "needs something to point at"),
        ):
            body = json.dumps({"mode": mode})
            got, text, _ = await ask(station, "POST", "/api/mode", data=body, headers=JSON)
            assert (got, why in text) == (status, True), text
        vehicle = station.station.status()["vehicle"]
        assert (vehicle["mode"], vehicle["effective"]) == ("horizon", "body")
        assert "start with --attitude" in vehicle["message"]

    flown(test, "script")


def test_control_needs_the_json_type_which_other_sites_cannot_send_unasked() -> None:
    async def test(station: Bench) -> None:
        body = '{"tracker":"script","action":"disable"}'
        assert (await ask(station, "POST", "/api/control", data=body))[0] == 415

    flown(test, "script")


@pytest.mark.parametrize("origin", ["https://evil.example", "null", "http://127.0.0.1:1"])
def test_other_sites_cannot_post(origin: str) -> None:
    async def test(station: Bench) -> None:
        headers = {**SDP, "Origin": origin}
        status, text, _ = await ask(station, "POST", "/whep", data="v=0", headers=headers)
        assert (status, origin in text) == (403, True)

    flown(test)


def test_the_own_page_can_post() -> None:
    async def test(station: Bench) -> None:
        headers = {**SDP, "Origin": station.base}
        sdp = await offer(station)
        assert (await ask(station, "POST", "/whep", data=sdp, headers=headers))[0] == 201

    flown(test)


def test_rebound_names_are_refused() -> None:
    async def test(station: Bench) -> None:
        status, text, _ = await ask(station, "GET", "/", headers={"Host": "evil.example:80"})
        assert (status, "evil.example" in text) == (403, True)
        assert (await ask(station, "GET", "/", headers={"Host": "localhost:80"}))[0] == 200

    flown(test)


def test_nothing_but_the_package_files_without_the_token() -> None:
    async def test(station: Bench) -> None:
        for path in ("/", "/?token=wrong", "/?token=", "/api/station", "/nothing"):
            status, text, headers = await ask(station, "GET", path)
            assert (status, "token" in text) == (401, True), path
            assert headers["WWW-Authenticate"] == "Bearer"
        assert (await ask(station, "POST", "/whep", data="v=0", headers=SDP))[0] == 401
        assert (await ask(station, "DELETE", "/whep/some"))[0] == 401
        assert (await ask(station, "GET", "/view.glsl"))[0] == 200

    flown(test, guard=Guard("se-cret"))


def test_with_the_token_everything_opens() -> None:
    async def test(station: Bench) -> None:
        bearer = {"Authorization": "Bearer se-cret"}
        assert (await ask(station, "GET", "/?token=se-cret"))[0] == 200
        assert (await ask(station, "GET", "/api/station", headers=bearer))[0] == 200
        sdp = await offer(station)
        headers = {**SDP, **bearer}
        assert (await ask(station, "POST", "/whep", data=sdp, headers=headers))[0] == 201

    flown(test, guard=Guard("se-cret"))


def test_status_tells_a_lens_profile_of_another_shape() -> None:
    async def test(station: Bench) -> None:
        camera = Camera(station.source, size=(320, 240))
        camera.send()
        status = await until(
            lambda: (s := station.station.status()["source"])["size"] and s, "a size"
        )
        assert "another shape" in status["message"]
        assert status["size"] == [320, 240]

    flown(test)
