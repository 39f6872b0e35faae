// Lines and numbers over the picture: the vehicle's horizon, where its nose is, the tape that
// tells where the head points, and the outline of the view on the whole fisheye.

import { toAngles } from './quaternion.js';
import { outline, projectDirection } from './viewport.js';

/** @typedef {import('./quaternion.js').Quaternion} Quaternion */
/** @typedef {import('./viewport.js').Viewport} Viewport */
/** @typedef {import('./renderer.js').Rect} Rect */
/** @typedef {import('./camera.js').Point} Point */
/** @typedef {CanvasRenderingContext2D} Context */

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

/** Lines with a dark rim, so that they show on any picture.
 * @param {Context} context @param {(Point | null)[]} points broken at null @param {number} width */
function stroke(context, points, width, color = LINE) {
  context.beginPath();
  let pen = false;
  for (const point of points) {
    if (point) pen ? context.lineTo(...point) : context.moveTo(...point);
    pen = point !== null;
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
  clipped(context, rect, () => {
    stroke(context, level(0), 1.5);
    context.globalAlpha = 0.45;
    context.setLineDash([2, 7]);
    for (const pitch of [-60, -30, 30, 60]) stroke(context, level(pitch), 1);
    context.setLineDash([]);
    context.globalAlpha = 1;
    for (let yaw = -180; yaw < 180; yaw += 10) drawTick(context, at, yaw);
    for (let yaw = -180; yaw < 180; yaw += 45) {
      for (const pitch of [-60, -30, 30, 60]) drawLabel(context, at(yaw, pitch), signed(pitch), 0.7);
    }
    drawNose(context, at);
  });
}

/** @param {Context} context @param {(yaw: number, pitch: number) => Point | null} at
 * @param {number} yaw */
function drawTick(context, at, yaw) {
  const big = yaw % 30 === 0;
  if (yaw === 0) return;
  stroke(context, [at(yaw, 0), at(yaw, big ? 1.6 : 0.8)], 1.5);
  if (big) drawLabel(context, at(yaw, 3.2), bearing(yaw), 1);
}

/** @param {Context} context @param {Point | null} point @param {string} text
 * @param {number} alpha */
function drawLabel(context, point, text, alpha) {
  if (!point) return;
  context.globalAlpha = alpha;
  label(context, text, ...point);
  context.globalAlpha = 1;
}

/** The vehicle's nose: wings and a ring. @param {Context} context
 * @param {(yaw: number, pitch: number) => Point | null} at */
function drawNose(context, at) {
  const ring = Array.from({ length: 25 }, (_, i) =>
    at(1.2 * Math.cos((i * Math.PI) / 12), 1.2 * Math.sin((i * Math.PI) / 12)));
  stroke(context, ring, 2);
  stroke(context, [at(-5, 0), at(-1.2, 0)], 2.5);
  stroke(context, [at(1.2, 0), at(5, 0)], 2.5);
  stroke(context, [at(0, 1.2), at(0, 3)], 2.5);
}

/** Where the head points, as a tape of bearings, with pitch and roll below it.
 * @param {Context} context @param {Rect} rect @param {Quaternion} q @param {number} top */
export function drawTape(context, rect, q, top) {
  const { yaw, pitch, roll } = toAngles(q);
  const width = Math.min(420, rect.width - 48);
  const tape = { x: rect.x + (rect.width - width) / 2, y: rect.y + top, width, height: 62 };
  const pxPerDeg = width / 120;
  clipped(context, tape, () => {
    for (let tick = Math.ceil((yaw - 60) / 10) * 10; tick <= yaw + 60; tick += 10) {
      const x = width / 2 + (tick - yaw) * pxPerDeg;
      context.globalAlpha = Math.max(0, 1 - Math.abs(tick - yaw) / 62);
      stroke(context, [[x, 1], [x, tick % 30 === 0 ? 10 : 6]], 1.5);
      if (tick % 30 === 0) label(context, bearing(((tick + 540) % 360) - 180), x, 19);
    }
    context.globalAlpha = 1;
    drawReadout(context, width / 2, `${bearing(yaw)}°`.replace(/([LR])°/, '° $1'));
    label(context, `PITCH ${signed(pitch)}°   ROLL ${signed(roll)}°`, width / 2, 52);
  });
}

/** @param {Context} context @param {number} x @param {string} text */
function drawReadout(context, x, text) {
  context.fillStyle = 'rgba(4, 18, 16, 0.8)';
  context.strokeStyle = LINE;
  context.lineWidth = 1.5;
  context.beginPath();
  context.roundRect(x - 34, 10, 68, 24, 5);
  context.fill();
  context.stroke();
  stroke(context, [[x, 0.5], [x, 9]], 2.5);
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
  clipped(context, place, () => stroke(context, points, 2, '#ffd166'));
}

/** A word in a pane's corner. @param {Context} context @param {Rect} rect @param {string} text */
export function drawCaption(context, rect, text) {
  clipped(context, rect, () => {
    context.textAlign = 'left';
    label(context, text, 12, rect.height - 14);
  });
}
