// The view kept inside the lens: a soft stop before the edge of the image circle. The formulas and
// their derivation are those of freelook/gimbal/limits.py.

import { angleBetween, inverse, multiply, rotate, slerp, turned } from './quaternion.js';
import { rayOf } from './projections.js';
import { focalPx, projectionOf } from './viewport.js';

/** @typedef {import('./quaternion.js').Quaternion} Quaternion */
/** @typedef {import('./viewport.js').Viewport} Viewport */
/** @typedef {[number, number]} Pair */

const KNEE = Math.PI / 18;
const PER_SIDE = 33; // places on a side of a view

/** How far from the optical axis a view may look, radians.
 * @param {Pair} outward @param {Pair} sides half the view on the plane z = 1
 * @param {number} thetaMax @returns {number} */
export function reach(outward, sides, thetaMax) {
  return Math.max(0, Math.min(...cornerLimits(outward, sides, thetaMax),
    ...edgeLimits(outward, sides, thetaMax)));
}

/** The same for a view of any projection, by points of its border where that is not straight.
 * @param {Pair} outward @param {Viewport} view @param {number} thetaMax @returns {number} */
export function reachOf(outward, view, thetaMax) {
  const projection = projectionOf(view);
  const f = focalPx(view);
  const [right, bottom] = [view.width / 2 / f, view.height / 2 / f];
  if (projection === 'crop') return thetaMax;
  if (projection === 'perspective') return reach(outward, [right, bottom], thetaMax);
  let least = Math.PI;
  for (let i = 0; i < PER_SIDE; i += 1) {
    const along = (2 * i) / (PER_SIDE - 1) - 1;
    for (const [x, y] of [[along, -1], [along, 1], [-1, along], [1, along]]) {
      const ray = rayOf(projection, x * right, y * bottom);
      const [u, z] = [ray[0] * outward[0] + ray[1] * outward[1], ray[2]];
      const cosine = Math.cos(thetaMax) * Math.hypot(...ray) / Math.max(Math.hypot(u, z), 1e-9);
      least = Math.min(least, Math.acos(Math.max(-1, Math.min(1, cosine))) - Math.atan2(u, z));
    }
  }
  return Math.max(0, least);
}

/** @param {Pair} outward @param {Pair} sides @param {number} thetaMax @returns {number[]} */
function cornerLimits(outward, sides, thetaMax) {
  const corners = [[1, 1], [1, -1], [-1, 1], [-1, -1]];
  return corners.map(([right, down]) => {
    const [x, y] = [right * sides[0], down * sides[1]];
    const u = x * outward[0] + y * outward[1];
    const cosine = Math.cos(thetaMax) * Math.hypot(1, x, y) / Math.hypot(1, u);
    return Math.acos(Math.max(-1, Math.min(1, cosine))) - Math.atan(u);
  });
}

/** @param {Pair} outward @param {Pair} sides @param {number} thetaMax @returns {number[]} */
function edgeLimits(outward, sides, thetaMax) {
  if (thetaMax <= Math.PI / 2) return [];
  return [0, 1].flatMap((axis) => [-1, 1].flatMap((sign) => {
    const [out, along] = [sign * outward[axis], outward[1 - axis]];
    const [side, half] = [sides[axis], sides[1 - axis]];
    const sine = Math.sin(thetaMax) * Math.hypot(1, side) / Math.hypot(out, side);
    if (sine > 1) return [];
    const theta = Math.PI - Math.asin(sine) - Math.atan2(side, out);
    const depth = -Math.cos(theta) + side * Math.sin(thetaMax) / Math.hypot(1, side);
    return depth > 0 && Math.abs(Math.sin(theta) * along) <= half * depth ? [theta] : [];
  }));
}

/** theta, slowed down in the last `knee` before the limit; never beyond it.
 * @param {number} theta @param {number} limit @param {number} knee */
export function softened(theta, limit, knee = KNEE) {
  const last = Math.min(knee, limit / 2);
  const start = limit - last;
  if (theta <= start || last <= 0) return Math.min(theta, limit);
  return limit - last * Math.exp(-(theta - start) / last);
}

export class LensLimit {
  /** @param {import('./camera.js').Camera} camera @param {number} rateDegS how fast the view goes
   * to the other side when the head passes straight behind the lens */
  constructor(camera, rateDegS) {
    this.camera = camera;
    this.rate = rateDegS * Math.PI / 180;
    /** @type {{ms: number, wanted: Quaternion, shown: Quaternion} | null} */
    this.last = null;
    /** whether the view is on its way to where it should be */
    this.moving = false;
    /** how far the lens's edge keeps the view from where it was wanted, degrees */
    this.holding = 0;
  }

  /** @param {Quaternion} wanted @param {Viewport} view @param {number} nowMs
   * @returns {Quaternion} the same view, or the nearest that the lens sees */
  apply(wanted, view, nowMs) {
    const limited = this.stopped(wanted, view);
    const slewed = this.slewed(wanted, limited, nowMs);
    this.moving = slewed !== limited;
    const shown = this.moving ? this.stopped(slewed, view, 0) : limited;
    this.last = { ms: nowMs, wanted, shown };
    this.holding = (angleBetween(wanted, shown) * 180) / Math.PI;
    return shown;
  }

  /** @param {Quaternion} wanted @param {Viewport} view @param {number} [knee]
   * @returns {Quaternion} */
  stopped(wanted, view, knee = KNEE) {
    const m = this.camera.cameraFromHead;
    const [x, y, z] = rotate(inverse(wanted), [m[6], m[7], m[8]]); // the optical axis
    const away = Math.hypot(x, y);
    /** @type {Pair} */
    const outward = away > 1e-12 ? [-x / away, -y / away] : [1, 0];
    const theta = Math.atan2(away, z);
    const thetaMax = 2 * Math.atan(Math.sqrt(this.camera.tMax));
    const limit = reachOf(outward, view, thetaMax);
    const kept = softened(theta, limit, knee);
    if (kept === theta) return wanted;
    return multiply(wanted, turned([-outward[1], outward[0], 0], kept - theta));
  }

  /** @param {Quaternion} wanted @param {Quaternion} limited @param {number} nowMs */
  slewed(wanted, limited, nowMs) {
    if (!this.last) return limited;
    const seconds = Math.max(0, nowMs - this.last.ms) / 1000;
    const most = angleBetween(this.last.wanted, wanted) + this.rate * seconds;
    const apart = angleBetween(this.last.shown, limited);
    return apart <= most + 1e-9 ? limited : slerp(this.last.shown, limited, most / apart);
  }
}
