// Lines and numbers over the picture: the vehicle's horizon, where its nose is, the tape that
// tells where the head points, and the outline of the view on the whole fisheye.

import { COLORS } from './pen.js';
import { toAngles, wrapped } from './quaternion.js';
import { outline, projectDirection } from './viewport.js';

/** @typedef {import('./quaternion.js').Quaternion} Quaternion */
/** @typedef {import('./viewport.js').Viewport} Viewport */
/** @typedef {import('./renderer.js').Rect} Rect */
/** @typedef {import('./camera.js').Point} Point */
/** @typedef {import('./pen.js').Pen} Pen */

const CIRCLE = Array.from({ length: 36 }, (_, i) => 10 * i - 180);
const LADDER = [-60, -30, 30, 60];

/** Text for a direction relative to the vehicle's nose. @param {number} yawDeg */
export function bearing(yawDeg) {
  const whole = Math.round(Math.abs(yawDeg));
  if (whole === 0) return '0';
  return whole === 180 ? '180' : `${whole}${yawDeg < 0 ? 'L' : 'R'}`;
}

/** @param {number} degrees */
export const signed = (degrees) =>
  (Math.round(degrees) > 0 ? '+' : Math.round(degrees) < 0 ? '−' : '') + Math.abs(Math.round(degrees));

/** The vehicle's level plane, lines of equal pitch, and the nose.
 * @param {Pen} pen @param {Rect} rect @param {Viewport} view @param {Quaternion} q */
export function drawHorizon(pen, rect, view, q) {
  const at = (/** @type {number} */ yaw, /** @type {number} */ pitch) => {
    const point = projectDirection(view, q, yaw, pitch);
    const far = point && Math.max(Math.abs(point[0]), Math.abs(point[1])) > 8 * view.width + 4000;
    return far ? null : point;
  };
  const level = (/** @type {number} */ pitch) =>
    Array.from({ length: 121 }, (_, i) => at(3 * i - 180, pitch));
  const ticks = CIRCLE.filter((yaw) => yaw !== 0)
    .map((yaw) => [at(yaw, 0), at(yaw, yaw % 30 === 0 ? 1.6 : 0.8)]);
  pen.inside(rect);
  pen.opacity = 0.45;
  pen.stroke(LADDER.flatMap((pitch) => dashes(level(pitch))), 1);
  for (const yaw of CIRCLE.filter((degrees) => degrees % 60 === 0)) {
    for (const pitch of LADDER) labelAt(pen, at(yaw, pitch), rect, signed(pitch));
  }
  pen.opacity = 1;
  pen.stroke([level(0), ...ticks], 1.5);
  for (const yaw of CIRCLE.filter((degrees) => degrees % 30 === 0 && degrees !== 0)) {
    labelAt(pen, at(yaw, 3.2), rect, bearing(yaw));
  }
  pen.stroke(nose(at), 2.5);
}

/** Every other piece of a line. @param {(Point | null)[]} points */
const dashes = (points) => points.slice(1).map((point, i) => (i % 2 ? [] : [points[i], point]));

/** @param {Pen} pen @param {Point | null} point @param {Rect} rect @param {string} text */
function labelAt(pen, point, rect, text) {
  const seen = point && point[0] > -20 && point[0] < rect.width + 20
    && point[1] > -10 && point[1] < rect.height + 10;
  if (seen) pen.text(text, ...point);
}

/** The vehicle's nose: wings and a ring.
 * @param {(yaw: number, pitch: number) => Point | null} at */
function nose(at) {
  const ring = Array.from({ length: 25 }, (_, i) =>
    at(1.2 * Math.cos((i * Math.PI) / 12), 1.2 * Math.sin((i * Math.PI) / 12)));
  return [ring, [at(-5, 0), at(-1.2, 0)], [at(1.2, 0), at(5, 0)], [at(0, 1.2), at(0, 3)]];
}

/** Where the head points, as a tape of bearings, with pitch and roll below it.
 * @param {Pen} pen @param {Rect} place @param {Quaternion} q */
export function drawTape(pen, place, q) {
  const { yaw, pitch, roll } = toAngles(q);
  const { width } = place;
  const middle = width / 2;
  const first = Math.ceil((yaw - 60) / 10) * 10;
  const ticks = Array.from({ length: 12 }, (_, i) => first + 10 * i)
    .map((degrees) => ({ degrees, x: middle + ((degrees - yaw) * width) / 120 }));
  pen.inside(place);
  pen.stroke(ticks.map(({ degrees, x }) => [[x, 1], [x, degrees % 30 === 0 ? 10 : 6]]), 1.5);
  for (const { degrees, x } of ticks) {
    const free = Math.abs(x - middle) > 48 && x > 14 && x < width - 14;
    if (free && degrees % 30 === 0) pen.text(bearing(wrapped(degrees)), x, 19);
  }
  drawReadout(pen, middle, `${bearing(yaw)}°`.replace(/([LR])°/, '° $1'));
  pen.text(`PITCH ${signed(pitch)}°  ROLL ${signed(roll)}°`, middle, 52);
}

/** @param {Pen} pen @param {number} x @param {string} text */
function drawReadout(pen, x, text) {
  const [left, right, top, bottom] = [x - 34, x + 34, 10, 34];
  pen.fill({ x: left, y: top, width: right - left, height: bottom - top });
  pen.stroke([[[left, top], [right, top]], [[right, top], [right, bottom]],
    [[right, bottom], [left, bottom]], [[left, bottom], [left, top]]], 1.5);
  pen.stroke([[[x, 0.5], [x, 9]]], 2.5);
  pen.text(text, x, 22.5, 15, COLORS.bright);
}

/** The view's border on the whole fisheye.
 * @param {Pen} pen @param {Rect} place where the picture lies
 * @param {import('./camera.js').Camera} camera @param {Viewport} view @param {Quaternion} q */
export function drawOutline(pen, place, camera, view, q) {
  const scale = [place.width / camera.size[0], place.height / camera.size[1]];
  const points = outline(view, q, camera).map((pixel) =>
    pixel && /** @type {Point} */ ([(pixel[0] + 0.5) * scale[0], (pixel[1] + 0.5) * scale[1]]));
  pen.inside(place);
  pen.stroke([points], 2, COLORS.amber);
}

/** A word at a pane's foot. @param {Pen} pen @param {Rect} rect @param {string} text */
export function drawCaption(pen, rect, text) {
  pen.inside(rect);
  pen.text(text, 70, rect.height - 16);
}
