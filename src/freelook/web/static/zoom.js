// The field of view: degrees across the longer side of the view. Its limits are the station's, which
// knows how finely the camera resolves (freelook/gimbal/zoom.py).

import { halfAngle } from './projections.js';

/** @typedef {{narrowest_deg: number, widest_deg: number, focal_px: number,
 *   projections?: Record<string, {narrowest_deg: number, widest_deg: number}>}} ZoomLimits
 * focal_px: the longest focal length in view pixels; beyond it the camera's pixels only grow
 * projections: the limits of those other than perspective */

/** @type {ZoomLimits} where no station knows of any */
const ANY = { narrowest_deg: 10, widest_deg: 150, focal_px: Infinity };

export class Zoom {
  /** @param {number} startDeg @param {ZoomLimits} limits */
  constructor(startDeg, limits = ANY) {
    this.limits = limits;
    this.projection = 'perspective';
    /** @type {Map<string, number>} fields of the projections that were left */
    this.left = new Map();
    /** pixels across the longer side of the view */
    this.spanPx = 0;
    this.startDeg = startDeg;
    this.fieldDeg = startDeg;
  }

  get narrowestDeg() {
    const { narrowest_deg: least, widest_deg: most } = this.range;
    const across = this.spanPx / 2 / this.limits.focal_px;
    const coarse = (2 * halfAngle(this.projection, across) * 180) / Math.PI;
    return Math.min(most, Math.max(least, coarse));
  }

  get range() {
    return this.limits.projections?.[this.projection] ?? this.limits;
  }

  /** Views have this projection from now on, with the field it had last. @param {string} projection */
  use(projection) {
    if (projection === this.projection) return;
    this.left.set(this.projection, this.fieldDeg);
    this.projection = projection;
    this.set(this.left.get(projection) ?? this.startDeg);
  }

  /** @param {number} factor above 1: wider */
  by(factor) {
    this.set(this.fieldDeg * factor);
  }

  /** @param {number} fieldDeg */
  set(fieldDeg) {
    if (Number.isFinite(fieldDeg)) {
      this.fieldDeg = Math.max(this.narrowestDeg, Math.min(this.range.widest_deg, fieldDeg));
    }
  }
}
