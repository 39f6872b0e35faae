// The phone's orientation sensor as a head.
//
// W3C Device Orientation: alpha, beta, gamma turn about z, x', y'' from axes east, north, up to
// the device's own: x right, y to the top edge, z out of the screen.
// https://www.w3.org/TR/orientation-event/

import { afterLoss } from './loss.js';
import { IDENTITY, about, fromAngles, inverse, multiply, toAngles } from './quaternion.js';

/** @typedef {import('./quaternion.js').Quaternion} Quaternion */

const SILENT_MS = 1000;

// A level traveller looking north has axes (east, down, north): x right, y down, z forward.
const EARTH_FROM_LEVEL = about(0, -90);
// The view looks out of the back of the screen, with y down.
const SCREEN_FROM_VIEW = about(0, 180);

/** Where a view through the phone points, relative to level and north.
 * @param {number} alpha @param {number} beta @param {number} gamma degrees, as in the event
 * @param {number} screenAngle degrees, `screen.orientation.angle` @returns {Quaternion} */
export function levelFromView(alpha, beta, gamma, screenAngle) {
  const earthFromDevice = multiply(about(2, alpha), multiply(about(0, beta), about(1, gamma)));
  const earthFromScreen = multiply(earthFromDevice, about(2, -screenAngle));
  return multiply(inverse(EARTH_FROM_LEVEL), multiply(earthFromScreen, SCREEN_FROM_VIEW));
}

export class PhoneHead {
  /** @param {import('./settings.js').Settings} settings
   * @param {() => import('./loss.js').Patience} patience @param {() => void} onPose */
  constructor(settings, patience, onPose) {
    this.settings = settings;
    this.patience = patience;
    this.onPose = onPose;
    this.enabled = true;
    this.listening = false;
    /** @type {Quaternion | null} */
    this.levelFromView = null;
    /** @type {{yawDeg: number, mount: Quaternion} | null} the neutral direction */
    this.neutral = null;
    this.stampMs = -Infinity;
  }

  /** Asks for the sensor; must be called from a tap (iOS). null when events may now come, else
   * why they cannot. @returns {Promise<string | null>} */
  async start() {
    if (!window.isSecureContext) {
      return 'Browsers give the motion sensor only to secure pages: open this one with https.';
    }
    if (typeof DeviceOrientationEvent === 'undefined') return 'This device has no motion sensor.';
    // @ts-ignore only iOS asks
    const permission = await DeviceOrientationEvent.requestPermission?.().catch(() => 'denied');
    if (permission === 'denied') return 'The motion sensor was not allowed.';
    if (!this.listening) window.addEventListener('deviceorientation', (event) => this.moved(event));
    this.listening = true;
    return null;
  }

  /** @param {DeviceOrientationEvent} event */
  moved({ alpha, beta, gamma, timeStamp }) {
    if (alpha === null || beta === null || gamma === null) return;
    this.levelFromView = levelFromView(alpha, beta, gamma, screen.orientation?.angle ?? 0);
    this.stampMs = timeStamp;
    if (!this.neutral) this.recentre();
    this.onPose();
  }

  /** The way the phone is held now becomes straight ahead; turning about the vertical stays yaw. */
  recentre() {
    if (!this.levelFromView) return;
    const { yaw } = toAngles(this.levelFromView);
    const tilt = multiply(about(1, -yaw), this.levelFromView);
    this.neutral = { yawDeg: yaw, mount: inverse(tilt) };
  }

  /** @param {number} nowMs @returns {import('./hand.js').Aim} */
  aim(nowMs) {
    if (!this.enabled) return { q: IDENTITY, state: 'disabled', stampMs: null };
    if (!this.levelFromView || !this.neutral) return { q: IDENTITY, state: 'waiting', stampMs: null };
    const turned = multiply(about(1, -this.neutral.yawDeg), this.levelFromView);
    const q = this.scaled(multiply(turned, this.neutral.mount));
    const ageMs = nowMs - this.stampMs;
    if (ageMs < SILENT_MS) return { q, state: 'tracking', stampMs: this.stampMs, ageMs, based: true };
    return { ...afterLoss(ageMs / 1000, this.patience()), q, stampMs: null, ageMs, based: true };
  }

  /** @param {Quaternion} q @returns {Quaternion} */
  scaled(q) {
    const axes = /** @type {const} */ (['yaw', 'pitch', 'roll']);
    const plain = axes.every((axis) =>
      this.settings.gain('phone', axis) === 1 && !this.settings.deadZone('phone', axis));
    if (plain) return q;
    const angles = toAngles(q);
    for (const axis of axes) {
      const beyond = Math.max(0, Math.abs(angles[axis]) - this.settings.deadZone('phone', axis));
      angles[axis] = Math.sign(angles[axis]) * beyond * this.settings.gain('phone', axis);
    }
    return fromAngles(angles);
  }
}
