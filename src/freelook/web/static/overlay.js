// Lines and numbers over the picture: the vehicle's horizon, where its nose is, the tape that
// tells where the head points, and the outline of the view on the whole fisheye.

import { toAngles, wrapped } from './quaternion.js';
import { outline, projectDirection } from './viewport.js';

/** @typedef {import('./quaternion.js').Quaternion} Quaternion */
/** @typedef {import('./viewport.js').Viewport} Viewport */
/** @typedef {import('./renderer.js').Rect} Rect */
/** @typedef {import('./camera.js').Point} Point */
/** @typedef {CanvasRenderingContext2D} Context */

const CIRCLE = Array.from({ length: 36 }, (_, i) => 10 * i - 180);
const LADDER = [-60, -30, 30, 60];
const LINE = '#8dffc5';
const DARK = 'rgba(0, 12, 10, 0.55)';
const FONT = '600 12px ui-monospace, "SF Mono", "Cascadia Mono", "DejaVu Sans Mono", monospace';

/** Text for a direction relative to the vehicle's nose. @param {number} yawDeg */
export function bearing(yawDeg) {
  const whole = Math.round(Math.abs(yawDeg));
  if (whole === 0) return '0';
  return whole === 180 ? '180' : `${whole}${yawDeg < 0 ? 'L' : 'R'}`;
}

/** @param {number} degrees */
export const signed = (degrees) =>
  (Math.round(degrees) > 0 ? '+' : Math.round(degrees) < 0 ? '−' : '') + Math.abs(Math.round(degrees));

/** Lines with a dark rim, so that they show on any picture; all at once, which is cheaper.
 * @param {Context} context @param {(Point | null)[][]} lines broken at null @param {number} width */
function stroke(context, lines, width, color = LINE) {
  context.beginPath();
  for (const points of lines) {
    let pen = false;
    for (const point of points) {
      if (point) pen ? context.lineTo(...point) : context.moveTo(...point);
      pen = point !== null;
    }
  }
  context.lineJoin = 'round';
  for (const [style, extra] of /** @type {[string, number][]} */ ([[DARK, 2.5], [color, 0]])) {
    context.strokeStyle = style;
    context.lineWidth = width + extra;
    context.stroke();
  }
}

/** @param {Context} context @param {string} text @param {number} x @param {number} y */
function label(context, text, x, y, color = LINE) {
  context.lineWidth = 3;
  context.strokeStyle = DARK;
  context.strokeText(text, x, y);
  context.fillStyle = color;
  context.fillText(text, x, y);
}

/** Draws inside `rect` with its corner as origin.
 * @param {Context} context @param {Rect} rect @param {() => void} draw */
function clipped(context, rect, draw) {
  context.save();
  context.beginPath();
  context.rect(rect.x, rect.y, rect.width, rect.height);
  context.clip();
  context.translate(rect.x, rect.y);
  context.font = FONT;
  context.textAlign = 'center';
  context.textBaseline = 'middle';
  draw();
  context.restore();
}

/** The vehicle's level plane, lines of equal pitch, and the nose.
 * @param {Context} context @param {Rect} rect @param {Viewport} view @param {Quaternion} q */
export function drawHorizon(context, rect, view, q) {
  const at = (/** @type {number} */ yaw, /** @type {number} */ pitch) => {
    const point = projectDirection(view, q, yaw, pitch);
    const far = point && Math.max(Math.abs(point[0]), Math.abs(point[1])) > 8 * view.width + 4000;
    return far ? null : point;
  };
  const level = (/** @type {number} */ pitch) =>
    Array.from({ length: 121 }, (_, i) => at(3 * i - 180, pitch));
  const ticks = CIRCLE.filter((yaw) => yaw !== 0)
    .map((yaw) => [at(yaw, 0), at(yaw, yaw % 30 === 0 ? 1.6 : 0.8)]);
  clipped(context, rect, () => {
    context.globalAlpha = 0.45;
    stroke(context, LADDER.flatMap((pitch) => dashes(level(pitch))), 1);
    for (const yaw of CIRCLE.filter((degrees) => degrees % 60 === 0)) {
      for (const pitch of LADDER) labelAt(context, at(yaw, pitch), rect, signed(pitch));
    }
    context.globalAlpha = 1;
    stroke(context, [level(0), ...ticks], 1.5);
    for (const yaw of CIRCLE.filter((degrees) => degrees % 30 === 0 && degrees !== 0)) {
      labelAt(context, at(yaw, 3.2), rect, bearing(yaw));
    }
    stroke(context, nose(at), 2.5);
  });
}

/** Every other piece of a line. @param {(Point | null)[]} points */
const dashes = (points) => points.slice(1).map((point, i) => (i % 2 ? [] : [points[i], point]));

/** @param {Context} context @param {Point | null} point @param {Rect} rect @param {string} text */
function labelAt(context, point, rect, text) {
  const seen = point && point[0] > -20 && point[0] < rect.width + 20
    && point[1] > -10 && point[1] < rect.height + 10;
  if (seen) label(context, text, ...point);
}

/** The vehicle's nose: wings and a ring.
 * @param {(yaw: number, pitch: number) => Point | null} at */
function nose(at) {
  const ring = Array.from({ length: 25 }, (_, i) =>
    at(1.2 * Math.cos((i * Math.PI) / 12), 1.2 * Math.sin((i * Math.PI) / 12)));
  return [ring, [at(-5, 0), at(-1.2, 0)], [at(1.2, 0), at(5, 0)], [at(0, 1.2), at(0, 3)]];
}

/** Where the head points, as a tape of bearings, with pitch and roll below it.
 * @param {Context} context @param {Rect} place @param {Quaternion} q */
export function drawTape(context, place, q) {
  const { yaw, pitch, roll } = toAngles(q);
  const { width } = place;
  const first = Math.ceil((yaw - 60) / 10) * 10;
  const ticks = Array.from({ length: 12 }, (_, i) => first + 10 * i)
    .map((degrees) => ({ degrees, x: width / 2 + ((degrees - yaw) * width) / 120 }));
  clipped(context, place, () => {
    stroke(context, ticks.map(({ degrees, x }) => [[x, 1], [x, degrees % 30 === 0 ? 10 : 6]]), 1.5);
    for (const { degrees, x } of ticks) {
      const free = Math.abs(x - width / 2) > 48 && x > 14 && x < width - 14;
      if (free && degrees % 30 === 0) label(context, bearing(wrapped(degrees)), x, 19);
    }
    drawReadout(context, width / 2, `${bearing(yaw)}°`.replace(/([LR])°/, '° $1'));
    label(context, `PITCH ${signed(pitch)}°   ROLL ${signed(roll)}°`, width / 2, 52);
  });
}

/** @param {Context} context @param {number} x @param {string} text */
function drawReadout(context, x, text) {
  context.fillStyle = 'rgba(4, 18, 16, 0.85)';
  context.strokeStyle = LINE;
  context.lineWidth = 1.5;
  context.beginPath();
  context.roundRect(x - 34, 10, 68, 24, 5);
  context.fill();
  context.stroke();
  stroke(context, [[[x, 0.5], [x, 9]]], 2.5);
  context.font = FONT.replace('12px', '15px');
  context.fillStyle = '#eafff5';
  context.fillText(text, x, 22.5);
  context.font = FONT;
}

/** The view's border on the whole fisheye.
 * @param {Context} context @param {Rect} place where the picture lies, CSS pixels
 * @param {import('./camera.js').Camera} camera @param {Viewport} view @param {Quaternion} q */
export function drawOutline(context, place, camera, view, q) {
  const scale = [place.width / camera.size[0], place.height / camera.size[1]];
  const points = outline(view, q, camera).map((pixel) =>
    pixel && /** @type {Point} */ ([(pixel[0] + 0.5) * scale[0], (pixel[1] + 0.5) * scale[1]]));
  clipped(context, place, () => stroke(context, [points], 2, '#ffd166'));
}

/** A word in a pane's corner. @param {Context} context @param {Rect} rect @param {string} text */
export function drawCaption(context, rect, text) {
  clipped(context, rect, () => {
    context.textAlign = 'left';
    label(context, text, 12, rect.height - 14);
  });
}
