// The data channel "head": poses and frame times from the station, and its clock.

import { IDENTITY, normalised } from './quaternion.js';
import { ClockOffset } from './statistics.js';

/** @typedef {import('./quaternion.js').Quaternion} Quaternion */
/** @typedef {{q: Quaternion, state: string, stampMs: number | null, receivedMs: number,
 *   left: Quaternion, based: boolean}} StationPose
 * stampMs: when the tracker measured it, page time; null if not known. based: q turns in the base
 * of the frame shown; then `left` is what is left of an earlier aim */
/**
 * @typedef {{mode: string, effective: string, state: string, message: string}} Vehicle
 * mode: what was asked for; effective: what is */
/**
 * @typedef {object} Status
 * @property {{state: string, message: string, age_ms: number | null, codec: string,
 *   size: [number, number] | null, transcoding: string | null, counters: Record<string, number>}} source
 * @property {{name: string, state: string, message: string, age_ms: number | null,
 *   rate_hz: number, counters: Record<string, number>}[]} trackers
 * @property {number} viewers @property {Vehicle} [vehicle]
 * @property {{name: string, state: string, message: string, shown: number}[]} [recordings]
 */

export const SILENT_MS = 1000; // the station sends its status four times a second
const FRAMES_KEPT = 256;

export class Link {
  /** @param {() => void} onPose @param {(rtp: number) => void} onFrame */
  constructor(onPose, onFrame) {
    this.onPose = onPose;
    this.onFrame = onFrame;
    this.clock = new ClockOffset();
    /** @type {Map<string, StationPose>} newest of each tracker */
    this.poses = new Map();
    /** @type {Map<number, number>} RTP time stamp to arrival at the station, its nanoseconds */
    this.arrivals = new Map();
    /** @type {Map<number, Quaternion>} RTP time stamp to the base in which heads turn in the frame */
    this.bases = new Map();
    /** @type {Map<number, Quaternion | null>} RTP time stamp to the vehicle's attitude then, in head
     * axes (north is ahead); null where that is not known */
    this.worlds = new Map();
    /** of the newest frame told about */
    this.newestBase = IDENTITY;
    /** @type {Quaternion | null} */
    this.newestWorld = null;
    /** @type {Status | null} */
    this.status = null;
    this.bad = 0;
    /** @type {number | null} */
    this.lastMs = null;
    /** @type {RTCDataChannel | null} */
    this.channel = null;
  }

  /** @param {RTCDataChannel} channel */
  attach(channel) {
    this.channel = channel;
    this.clock = new ClockOffset(); // the station may have been restarted, on another machine
    let sent = 0;
    const ping = () => {
      if (channel.readyState !== 'open' || channel !== this.channel) return;
      channel.send(JSON.stringify({ type: 'ping', t: performance.now() }));
      sent += 1;
      setTimeout(ping, sent < 10 ? 50 : 1000);
    };
    channel.onopen = ping;
    channel.onmessage = ({ data }) => {
      if (channel === this.channel) this.receive(data, performance.now());
    };
  }

  /** Whether the station is heard; false before it ever was. @param {number} nowMs */
  alive(nowMs) {
    return this.lastMs !== null && nowMs - this.lastMs < SILENT_MS;
  }

  /** @param {string} text @param {number} nowMs */
  receive(text, nowMs) {
    const message = parsed(text);
    if (this.understood(message, nowMs)) this.lastMs = nowMs;
    else this.bad += 1;
  }

  /** @param {any} message @param {number} nowMs @returns {boolean} */
  understood(message, nowMs) {
    switch (message?.type) {
      case 'pong': return this.pong(message, nowMs);
      case 'pose': return this.pose(message, nowMs);
      case 'frame': return this.frame(message);
      case 'status': return this.setStatus(message);
      default: return false;
    }
  }

  /** @param {any} message @param {number} nowMs */
  pong({ t, ns }, nowMs) {
    this.clock.add(t, nowMs, ns);
    return true;
  }

  /** @param {any} message @param {number} nowMs */
  pose({ tracker, q, state, t, left, based = false }, nowMs) {
    const unit = Array.isArray(q) ? normalised(q) : null;
    if (!unit || typeof tracker !== 'string') return false;
    this.poses.set(tracker, {
      q: unit, state, stampMs: this.clock.pageMs(t), receivedMs: nowMs, based: based === true,
      left: (Array.isArray(left) ? normalised(left) : null) ?? IDENTITY,
    });
    this.onPose();
    return true;
  }

  /** @param {any} message */
  frame({ rtp, arrival, base, world }) {
    if (!Number.isFinite(rtp) || !Number.isFinite(arrival)) return false;
    this.newestBase = (Array.isArray(base) ? normalised(base) : null) ?? IDENTITY;
    this.arrivals.set(rtp, arrival);
    this.bases.set(rtp, this.newestBase);
    this.newestWorld = Array.isArray(world) ? normalised(world) : null;
    this.worlds.set(rtp, this.newestWorld);
    for (const kept of [this.arrivals, this.bases, this.worlds]) {
      if (kept.size > FRAMES_KEPT) kept.delete(kept.keys().next().value ?? 0);
    }
    this.onFrame(rtp);
    return true;
  }

  /** @param {any} message */
  setStatus(message) {
    const { source, trackers, recordings = [] } = message;
    if (!source || !areObjects(trackers) || !areObjects(recordings)) return false;
    this.status = message;
    return true;
  }

  /** The base of a frame; of the newest one, where it is not known which frame it is; null for one
   * that was not told about yet. @param {number | null} rtp @returns {Quaternion | null} */
  baseOf(rtp) {
    return rtp === null ? this.newestBase : this.bases.get(rtp) ?? null;
  }

  /** The vehicle's attitude in a frame, null where the station does not know it; undefined for a
   * frame that was not told about yet. @param {number | null} rtp
   * @returns {Quaternion | null | undefined} */
  worldOf(rtp) {
    return rtp === null ? this.newestWorld : this.worlds.get(rtp);
  }

  /** When the frame came to the station, page time; null if not known.
   * @param {number | null} rtp */
  arrivalMs(rtp) {
    return rtp === null ? null : this.clock.pageMs(this.arrivals.get(rtp));
  }
}

/** @param {unknown} list */
const areObjects = (list) => Array.isArray(list)
  && list.every((one) => one !== null && typeof one === 'object');

/** @param {unknown} text @returns {any} */
function parsed(text) {
  try {
    return JSON.parse(String(text));
  } catch {
    return null;
  }
}
