// The field of view: degrees across the longer side of the view.

import { NARROWEST_DEG, WIDEST_DEG } from './viewport.js';

export class Zoom {
  /** @param {number} startDeg */
  constructor(startDeg) {
    this.startDeg = startDeg;
    this.fieldDeg = startDeg;
  }

  /** @param {number} factor above 1: wider */
  by(factor) {
    this.set(this.fieldDeg * factor);
  }

  /** @param {number} fieldDeg */
  set(fieldDeg) {
    if (Number.isFinite(fieldDeg)) {
      this.fieldDeg = Math.max(NARROWEST_DEG, Math.min(WIDEST_DEG, fieldDeg));
    }
  }
}
