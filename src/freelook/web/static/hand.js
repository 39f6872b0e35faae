// The head moved by hand: mouse, touch, keys and gamepad all turn this one.

import { IDENTITY, fromAngles, toAngles, wrapped } from './quaternion.js';

/** @typedef {import('./quaternion.js').Quaternion} Quaternion */
/** @typedef {import('./quaternion.js').Angles} Angles */
/** @typedef {{q: Quaternion, state: string, stampMs: number | null, ageMs?: number,
 *   based?: boolean, left?: Quaternion, gone?: number}} Aim
 * where a head points; stampMs: when that was measured, page time; based: in the base of the frame
 * shown (link.js), else relative to the vehicle; gone: the share of the way straight ahead that a
 * lost head's view has gone */

export class HandHead {
  constructor() {
    /** @type {Angles} */
    this.angles = { yaw: 0, pitch: 0, roll: 0 };
    /** @type {number | null} */
    this.stampMs = null;
    this.enabled = true;
  }

  /** @param {Partial<Angles>} by degrees @param {number} stampMs */
  turn({ yaw = 0, pitch = 0, roll = 0 }, stampMs) {
    const { angles } = this;
    this.set({ yaw: angles.yaw + yaw, pitch: angles.pitch + pitch, roll: angles.roll + roll }, stampMs);
  }

  /** @param {Angles} angles yaw and roll wrap around, pitch ends at straight up and down
   * @param {number} stampMs */
  set({ yaw, pitch, roll }, stampMs) {
    this.angles = {
      yaw: wrapped(yaw), pitch: Math.max(-90, Math.min(90, pitch)), roll: wrapped(roll),
    };
    this.stampMs = stampMs;
  }

  /** Takes over where another head points. @param {Quaternion} q @param {number} stampMs */
  follow(q, stampMs) {
    this.set(toAngles(q), stampMs);
  }

  /** @param {number} stampMs */
  recentre(stampMs) {
    this.set({ yaw: 0, pitch: 0, roll: 0 }, stampMs);
  }

  /** @returns {Aim} */
  aim() {
    if (!this.enabled) return { q: IDENTITY, state: 'disabled', stampMs: this.stampMs };
    return { q: fromAngles(this.angles), state: 'tracking', stampMs: this.stampMs, based: true };
  }
}
