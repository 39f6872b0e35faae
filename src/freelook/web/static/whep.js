// WHEP: one POST with an offer, one answer, one DELETE. Tries again for ever, with back-off.
//
// https://datatracker.ietf.org/doc/draft-ietf-wish-whep/

const RETRY_MS = { first: 250, most: 5000 };
const DISCONNECTED_MS = 2000; // ICE may find its way back by itself for so long
const ANSWER_MS = 8000;
const GATHER_MS = 1000;

/** @typedef {'connecting' | 'connected' | 'lost' | 'closed'} WhepState */

export class WhepClient {
  /**
   * @param {URL} url @param {Record<string, string>} headers e.g. Authorization
   * @param {object} listeners
   * @param {(stream: MediaStream) => void} listeners.onStream
   * @param {(channel: RTCDataChannel) => void} listeners.onChannel
   * @param {(state: WhepState, message: string) => void} listeners.onState
   */
  constructor(url, headers, listeners) {
    this.url = url;
    this.headers = headers;
    this.listeners = listeners;
    this.retryMs = RETRY_MS.first;
    /** @type {RTCPeerConnection | null} */
    this.peer = null;
    /** @type {URL | null} */
    this.resource = null;
    /** @type {number | undefined} */
    this.timer = undefined;
    this.closed = true;
    this.attempts = 0;
  }

  start() {
    if (!this.closed) return;
    this.closed = false;
    this.retryMs = RETRY_MS.first;
    this.connect();
  }

  /** Ends the session at the station too, also while the page is going away. */
  close() {
    this.closed = true;
    this.drop();
    this.listeners.onState('closed', '');
  }

  /** Starts over after a while; for whoever notices that nothing comes any more.
   * @param {string} message @param {number} [afterMs] */
  lost(message, afterMs = 0) {
    if (this.closed) return;
    this.drop();
    const wait = Math.max(this.retryMs, afterMs);
    this.retryMs = Math.min(this.retryMs * 2, RETRY_MS.most);
    this.listeners.onState('lost', message);
    this.timer = window.setTimeout(() => this.connect(), wait);
  }

  drop() {
    clearTimeout(this.timer);
    if (this.peer) {
      this.peer.onconnectionstatechange = null;
      this.peer.close();
    }
    this.peer = null;
    if (this.resource) {
      fetch(this.resource, { method: 'DELETE', headers: this.headers, keepalive: true })
        .catch(() => {}); // the station may be gone, which is why we leave
    }
    this.resource = null;
  }

  async connect() {
    this.attempts += 1;
    this.listeners.onState('connecting', '');
    const peer = this.makePeer();
    this.peer = peer;
    try {
      await peer.setLocalDescription(await peer.createOffer());
      await gathered(peer);
      const answer = await this.post(peer.localDescription?.sdp ?? '');
      if (this.peer === peer) await peer.setRemoteDescription({ type: 'answer', sdp: answer });
    } catch (error) {
      if (this.peer !== peer) return; // given up meanwhile
      const refused = error instanceof Refused ? error : null;
      this.lost(refused?.message ?? `the station does not answer (${message(error)})`, refused?.waitMs);
    }
  }

  makePeer() {
    const peer = new RTCPeerConnection({ iceServers: [], bundlePolicy: 'max-bundle' });
    const video = peer.addTransceiver('video', { direction: 'recvonly' });
    preferH264(video);
    showAtOnce(video.receiver);
    this.listeners.onChannel(peer.createDataChannel('head', { ordered: false, maxRetransmits: 0 }));
    peer.ontrack = ({ track }) => this.listeners.onStream(new MediaStream([track]));
    peer.onconnectionstatechange = () => this.changed(peer);
    return peer;
  }

  /** @param {RTCPeerConnection} peer */
  changed(peer) {
    clearTimeout(this.timer);
    const state = peer.connectionState;
    if (state === 'connected') {
      this.retryMs = RETRY_MS.first;
      this.listeners.onState('connected', '');
    } else if (state === 'disconnected') {
      this.timer = window.setTimeout(() => this.lost('the connection broke'), DISCONNECTED_MS);
    } else if (state === 'failed' || state === 'closed') {
      this.lost('the connection broke');
    }
  }

  /** @param {string} offer @returns {Promise<string>} */
  async post(offer) {
    const response = await fetch(this.url, {
      method: 'POST',
      headers: { ...this.headers, 'Content-Type': 'application/sdp' },
      body: offer,
      signal: AbortSignal.timeout(ANSWER_MS),
    });
    const text = await response.text();
    if (response.status !== 201) throw new Refused(response, text);
    const location = response.headers.get('Location');
    this.resource = location ? new URL(location, response.url) : null;
    return text;
  }
}

/** The station answered, and said no. */
class Refused extends Error {
  /** @param {Response} response @param {string} text */
  constructor(response, text) {
    super(text.trim().slice(0, 300) || `the station answered ${response.status}`);
    this.waitMs = Number(response.headers.get('Retry-After') ?? 0) * 1000 || 0;
  }
}

/** @param {unknown} error */
const message = (error) => (error instanceof Error ? error.message : String(error));

/** @param {RTCRtpTransceiver} transceiver */
function preferH264(transceiver) {
  const codecs = RTCRtpReceiver.getCapabilities?.('video')?.codecs ?? [];
  const rank = (/** @type {{mimeType: string}} */ { mimeType }) =>
    mimeType === 'video/H264' ? 0 : mimeType === 'video/rtx' ? 1 : 2;
  if (codecs.some((codec) => rank(codec) === 0)) {
    transceiver.setCodecPreferences?.([...codecs].sort((a, b) => rank(a) - rank(b)));
  }
}

/** No waiting for smoothness: a late frame is worth less than a jerky one.
 * @param {RTCRtpReceiver} receiver */
function showAtOnce(receiver) {
  if ('jitterBufferTarget' in receiver) receiver.jitterBufferTarget = 0;
  // @ts-ignore the older name of the same thing
  if ('playoutDelayHint' in receiver) receiver.playoutDelayHint = 0;
}

/** Resolves when all candidates are known, or soon anyway. @param {RTCPeerConnection} peer
 * @returns {Promise<void>} */
function gathered(peer) {
  return new Promise((resolve) => {
    const check = () => peer.iceGatheringState === 'complete' && resolve();
    peer.addEventListener('icegatheringstatechange', check);
    setTimeout(resolve, GATHER_MS);
    check();
  });
}
