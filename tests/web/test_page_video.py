"""Video by WebRTC into the page. The other end is in the page too: a stand-in for the station's
WHEP that answers with a canvas as camera."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from page_station import PageView

pytestmark = pytest.mark.browser

# The camera: left half red, right half blue, with a white bar that moves so that frames differ.
STATION = """
window.calls = [];
window.stations = [];
const camera = document.createElement('canvas');
[camera.width, camera.height] = [320, 240];
const paint = camera.getContext('2d');
let bar = 0;
setInterval(() => {
    paint.fillStyle = '#c02020';
    paint.fillRect(0, 0, 160, 240);
    paint.fillStyle = '#2020c0';
    paint.fillRect(160, 0, 160, 240);
    paint.fillStyle = '#ffffff';
    paint.fillRect(bar = (bar + 4) % 300, 0, 20, 20);
}, 33);
async function answer(offer) {
    const peer = new RTCPeerConnection();
    window.stations.push(peer);
    peer.ondatachannel = ({channel}) => {
        peer.channel = channel;
        const pong = () => JSON.stringify({type: 'pong', t: performance.now(), ns: 0});
        peer.says = setInterval(() => channel.readyState === 'open' && channel.send(pong()), 100);
    };
    await peer.setRemoteDescription({type: 'offer', sdp: offer});
    peer.addTrack(camera.captureStream(30).getVideoTracks()[0]);
    await peer.setLocalDescription(await peer.createAnswer());
    await new Promise(done => {
        const check = () => peer.iceGatheringState === 'complete' && done();
        peer.onicegatheringstatechange = check;
        check();
    });
    return peer.localDescription.sdp;
}
const plainFetch = window.fetch.bind(window);
window.fetch = async (resource, options = {}) => {
    const path = new URL(resource, location.href).pathname;
    if (!path.startsWith('/whep')) return plainFetch(resource, options);
    window.calls.push([options.method, path, options.headers['Content-Type'] ?? null]);
    if (options.method === 'DELETE') return new Response('ended');
    if (window.refusals > 0) {
        window.refusals -= 1;
        return new Response('no H.264 in the offer', {status: 406});
    }
    const sdp = await answer(options.body);
    const headers = {Location: '/whep/' + window.stations.length};
    const response = new Response(sdp, {status: 201, headers});
    Object.defineProperty(response, 'url', {value: new URL('/whep', location.href).href});
    return response;
};
"""


@pytest.fixture(params=["planes", "rgb"])
def video(request: pytest.FixtureRequest, open_page: Any) -> PageView:
    page: PageView = open_page(query=f"?upload={request.param}", script=STATION)
    page.until("freelook.stats().drawn > 3")
    page.set_view(40, 40, 30)
    return page


def halves(page: PageView) -> tuple[Any, Any]:
    page.set_head(-50, 0)
    left = page.view().mean(axis=(0, 1))
    page.set_head(50, 0)
    return left, page.view().mean(axis=(0, 1))


def test_video_is_drawn_in_its_colours(video: PageView) -> None:
    left, right = halves(video)
    assert np.abs(left - [0xC0, 0x20, 0x20]).max() < 25
    assert np.abs(right - [0x20, 0x20, 0xC0]).max() < 25
    stats = video.stats()
    assert stats["size"] == [320, 240]
    assert stats["received"] >= stats["drawn"] > 3
    assert stats["upload"] in video.page.url


def test_a_lost_station_keeps_its_last_picture_and_comes_back(video: PageView) -> None:
    video.js("window.refusals = 3; freelook.app.whep.lost('a test')")
    video.until("freelook.stats().grey === 1")
    left, _ = halves(video)
    assert left.mean() > 15  # grey, but not the black frame of a closed connection
    assert np.ptp(left) < 3
    drawn = video.stats()["drawn"]
    video.until(f"freelook.stats().drawn > {drawn + 3} && freelook.stats().grey === 0")
    assert video.stats()["whep"] == "connected"


def test_the_offer_and_the_end_of_a_session(open_page: Any) -> None:
    page = open_page(script=STATION)
    page.until("freelook.stats().whep === 'connected'")
    assert page.js("calls") == [["POST", "/whep", "application/sdp"]]
    offer = page.js("freelook.app.whep.peer.localDescription.sdp")
    assert "a=recvonly" in offer
    assert "H264" in offer
    first = offer.split("m=video ")[1].split()[2]  # the codec preferred
    assert f"a=rtpmap:{first} H264/90000" in offer
    channel = page.js("(c => [c.label, c.ordered, c.maxRetransmits])(freelook.app.link.channel)")
    assert channel == ["head", False, 0]
    page.js("dispatchEvent(new Event('pagehide'))")
    assert page.js("calls")[1][:2] == ["DELETE", "/whep/1"]
    page.js("dispatchEvent(new Event('pageshow'))")
    page.until("freelook.stats().whep === 'connected'")


def test_a_silent_station_is_left_and_called_again(open_page: Any) -> None:
    page = open_page(script=STATION)
    page.until("freelook.app.link.alive(performance.now())")
    page.js("stations.forEach(peer => clearInterval(peer.says))")
    page.shows("The station is silent")
    page.until("stations.length === 2 && freelook.app.link.alive(performance.now())")
    assert ["DELETE", "/whep/1", None] in page.js("calls")


def test_refusals_are_told_and_tried_again_ever_more_slowly(open_page: Any) -> None:
    page = open_page(script=STATION + "window.refusals = 2;")
    page.shows("Station lost: no H.264 in the offer. Trying again")
    waits = page.js("freelook.app.whep.retryMs")
    assert waits in (500, 1000)
    page.until("freelook.stats().whep === 'connected'")
    page.until("freelook.app.whep.retryMs === 250")
    page.page.get_by_text("Station lost").wait_for(state="detached")
