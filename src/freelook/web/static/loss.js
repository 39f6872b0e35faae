// When a head falls silent: hold the last direction, then ease to straight ahead. The station
// does the same for its trackers; here it is for the phone's sensor and for a lost station.

import { IDENTITY, slerp } from './quaternion.js';

/** @typedef {import('./quaternion.js').Quaternion} Quaternion */
/** @typedef {{holdS: number, easeS: number}} Patience */

/** @param {Quaternion} last @param {number} silentS @param {Patience} patience
 * @returns {{q: Quaternion, state: 'holding' | 'easing' | 'centred'}} */
export function afterLoss(last, silentS, { holdS, easeS }) {
  if (silentS <= holdS) return { q: last, state: 'holding' };
  const way = easeS > 0 ? (silentS - holdS) / easeS : 1;
  if (way >= 1) return { q: IDENTITY, state: 'centred' };
  return { q: slerp(last, IDENTITY, way * way * (3 - 2 * way)), state: 'easing' };
}
