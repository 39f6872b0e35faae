// The field of view: degrees across the longer side of the view. Its limits are the station's, which
// knows how finely the camera resolves (freelook/gimbal/zoom.py).

/** @typedef {{narrowest_deg: number, widest_deg: number, focal_px: number}} ZoomLimits
 * focal_px: the longest focal length in view pixels; beyond it the camera's pixels only grow */

export class Zoom {
  /** @param {number} startDeg @param {ZoomLimits} limits */
  constructor(startDeg, limits) {
    this.limits = limits;
    /** pixels across the longer side of the view */
    this.spanPx = 0;
    this.startDeg = startDeg;
    this.fieldDeg = startDeg;
  }

  get narrowestDeg() {
    const { narrowest_deg: least, widest_deg: most, focal_px: focal } = this.limits;
    const coarse = (2 * Math.atan(this.spanPx / 2 / focal) * 180) / Math.PI;
    return Math.min(most, Math.max(least, coarse));
  }

  /** @param {number} factor above 1: wider */
  by(factor) {
    this.set(this.fieldDeg * factor);
  }

  /** @param {number} fieldDeg */
  set(fieldDeg) {
    if (Number.isFinite(fieldDeg)) {
      this.fieldDeg = Math.max(this.narrowestDeg, Math.min(this.limits.widest_deg, fieldDeg));
    }
  }
}
