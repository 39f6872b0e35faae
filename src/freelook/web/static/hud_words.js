// Numbers as a HUD writes them, as freelook/hud/words.py does.

/** @typedef {Record<string, any>} Definition hud.json */

/** @type {Record<number, string>} */
const QUARTERS = { 0: 'N', 90: 'E', 180: 'S', 270: 'W' };

/** @param {number} value @param {number} by @returns {number} 0 to by */
export const modulo = (value, by) => ((value % by) + by) % by;

/** @param {number} value halves go up */
export const whole = (value) => Math.floor(value + 0.5);

/** @param {number} degrees */
export function signed(degrees) {
  const number = whole(Math.abs(degrees));
  return `${number === 0 ? '' : degrees > 0 ? '+' : '−'}${number}`;
}

/** A direction relative to the vehicle's nose: 30R, or 30°R. @param {number} yawDeg */
export function bearing(yawDeg, unit = '') {
  const away = modulo(yawDeg + 180, 360) - 180;
  const number = whole(Math.abs(away));
  if (number === 0 || number === 180) return `${number}${unit}`;
  return `${number}${unit}${away < 0 ? 'L' : 'R'}`;
}

/** @param {number} headingDeg */
export function compass(headingDeg) {
  const number = modulo(whole(headingDeg), 360);
  return QUARTERS[number] ?? String(number);
}

/** Milliseconds, 0 where clocks disagree by more: with a decimal below 10; from a second on, seconds.
 * @param {number} value @returns {string} */
export function tenths(value) {
  if (value < 0) return tenths(0);
  if (value >= 999.5) return `${tenths(value / 1000)}S`;
  if (value >= 10) return String(whole(value));
  const number = whole(10 * value);
  return `${Math.floor(number / 10)}.${number % 10}`;
}

/** As far as there are letters for it. @param {Definition} known @param {string} text */
export const capitals = (known, text) => [...String(text).toUpperCase()]
  .map((letter) => (letter === ' ' || letter in known.letters ? letter : '?')).join('');

/** @param {string} text @param {number} most letters */
export const shortened = (text, most) =>
  (text.length <= most ? text : `${text.slice(0, most - 1).trimEnd()}…`);

/** One of its words, filled in. @param {Definition} known @param {string} word
 * @param {Record<string, any>} [values] */
export const say = (known, word, values = {}) =>
  known.words[word].replace(/\{(\w+)\}/g, (/** @type {string} */ _, /** @type {string} */ name) =>
    String(values[name]));
