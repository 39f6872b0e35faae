// The two dials, never mixed: head latency (pose measured to view drawn) and video age (frame
// arrived at the station to view drawn). Each pose and each frame counts once, when first drawn.

import { RecentValues } from './statistics.js';

const WAITING = 64; // frames drawn before the station told when they came

export class Latency {
  /** @param {import('./link.js').Link} link */
  constructor(link) {
    this.link = link;
    this.head = new RecentValues();
    this.video = new RecentValues();
    /** only since the frame came to this browser; used where the station's times are missing */
    this.received = new RecentValues();
    /** @type {number | null} */
    this.lastStampMs = null;
    /** @type {Map<number, number>} RTP time stamp to time of drawing */
    this.waiting = new Map();
  }

  /** @param {number} nowMs @param {number | null} stampMs */
  poseDrawn(nowMs, stampMs) {
    if (stampMs === null || stampMs === this.lastStampMs) return;
    this.lastStampMs = stampMs;
    this.head.add(nowMs, nowMs - stampMs);
  }

  /** @param {number} nowMs @param {import('./video.js').FrameTimes} times */
  frameDrawn(nowMs, { receivedMs, rtp }) {
    if (receivedMs !== null) this.received.add(nowMs, nowMs - receivedMs);
    const arrivalMs = this.link.arrivalMs(rtp);
    if (arrivalMs !== null) {
      this.video.add(nowMs, nowMs - arrivalMs);
    } else if (rtp !== null) {
      this.waiting.set(rtp, nowMs);
      if (this.waiting.size > WAITING) this.waiting.delete(this.waiting.keys().next().value ?? 0);
    }
  }

  /** The station told when a frame came; it may have been drawn before. @param {number} rtp */
  frameTold(rtp) {
    const drawnMs = this.waiting.get(rtp);
    const arrivalMs = this.link.arrivalMs(rtp);
    if (drawnMs === undefined || arrivalMs === null) return;
    this.waiting.delete(rtp);
    this.video.add(drawnMs, drawnMs - arrivalMs);
  }

  /** @param {number} nowMs */
  summary(nowMs) {
    const video = this.video.summary(nowMs);
    const whole = video.count > 0;
    return {
      head: this.head.summary(nowMs),
      video: whole ? video : this.received.summary(nowMs),
      /** what the video age is counted from */
      videoSince: whole ? 'since arrival' : 'since reception',
    };
  }
}
