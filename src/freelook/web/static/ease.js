// From an old aim to a new one without a jump, as freelook/gimbal/easing.py does it.

import { IDENTITY, angleBetween, inverse, multiply, slerp } from './quaternion.js';

/** @typedef {import('./quaternion.js').Quaternion} Quaternion */

const PEAK = 15 / 8; // of the speed, over its mean
const LEAST_S = 0.3;

/** @param {number} x 0 to 1 */
export const smooth = (x) => x ** 3 * (10 + x * (6 * x - 15));

export class Ease {
  /** @param {number} rateDegS never faster */
  constructor(rateDegS) {
    this.rate = rateDegS * Math.PI / 180;
    this.leftover = IDENTITY;
    this.startMs = 0;
    this.seconds = 0;
  }

  /** @param {Quaternion} before @param {Quaternion} after @param {number} nowMs */
  start(before, after, nowMs) {
    this.leftover = multiply(before, inverse(after));
    this.startMs = nowMs;
    this.seconds = Math.max(LEAST_S, (PEAK * angleBetween(before, after)) / this.rate);
  }

  stop() {
    this.seconds = 0;
  }

  /** @param {number} nowMs */
  active(nowMs) {
    return nowMs < this.startMs + 1000 * this.seconds;
  }

  /** @param {Quaternion} aim @param {number} nowMs @returns {Quaternion} */
  apply(aim, nowMs) {
    if (!this.active(nowMs)) return aim;
    const x = Math.max(0, (nowMs - this.startMs) / 1000 / this.seconds);
    return multiply(slerp(this.leftover, IDENTITY, smooth(x)), aim);
  }
}
