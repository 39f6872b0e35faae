// When a head falls silent: hold the last direction, then ease to straight ahead. The station
// does the same for its trackers; here it is for the phone's sensor and for a lost station.

import { smooth } from './ease.js';

/** @typedef {{holdS: number, easeS: number}} Patience */

/** @param {number} silentS @param {Patience} patience
 * @returns {{gone: number, state: 'holding' | 'easing' | 'centred'}} gone: the share of the way
 * straight ahead */
export function afterLoss(silentS, { holdS, easeS }) {
  if (silentS <= holdS) return { gone: 0, state: 'holding' };
  const way = easeS > 0 ? (silentS - holdS) / easeS : 1;
  if (way >= 1) return { gone: 1, state: 'centred' };
  return { gone: smooth(way), state: 'easing' };
}
