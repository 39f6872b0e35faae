// From the numbers to lines, boxes and words on the view; freelook/hud/shapes.py makes the same
// ones of the same hud.json, and a test compares them. Points from the view's top left corner.

import { placeOf, rayOf } from './projections.js';
import { apply, matrix, matrixProduct, normalised } from './quaternion.js';
import { bearing, capitals, compass, modulo, say, shortened, signed, tenths, whole } from './hud_words.js';
import { focalPx } from './viewport.js';

/** @typedef {import('./quaternion.js').Quaternion} Quaternion */
/** @typedef {import('./quaternion.js').Vector} Vector */
/** @typedef {import('./camera.js').Point} Point */
/** @typedef {import('./renderer.js').Rect} Rect */
/** @typedef {import('./hud_words.js').Definition} Definition */
/** @typedef {[number, number, number, number]} Piece x0, y0, x1, y1 */
/** @typedef {{median: number | null, p95: number | null}} Dial milliseconds */
/**
 * @typedef {object} HudState what is not known is null or not there
 * @property {Quaternion} q where the view looks, relative to a head that looks straight ahead
 * @property {Quaternion | null} [world] the vehicle's attitude, in the same axes: north is ahead
 * @property {number} hfovDeg @property {string} projection
 * @property {{thetaMax: number, cameraFromHead: number[]} | null} [lens]
 * @property {{state: string, lost: number} | null} [link]
 * @property {{name: string, state: string} | null} [tracker] @property {string} [mode]
 * @property {{state: string, shown: number} | null} [recording]
 * @property {{level: string, text: string}[]} [warnings] @property {Record<string, Dial>} [dials]
 */
/**
 * @typedef {{width: number, height: number, tape: Rect, sidesY: number, middleY: number,
 *   parts: string[], inset: number[]}} Place where the tape goes; from where down there is room at
 * the sides and in the middle; what is left free on each side, across and down
 */
/** @typedef {{kind: 'lines', pieces: Piece[], width: number, role: string, opacity: number}
 *   | {kind: 'box', rect: Rect, role: string, opacity: number}
 *   | {kind: 'text', text: string, x: number, y: number, size: number, role: string,
 *      anchor: string, opacity: number}} Shape */
/** @typedef {{known: Definition, state: HudState, place: Place, focal: number, cut: boolean,
 *   headFromView: number[], levelFromHead: number[], levelFromView: number[],
 *   world: boolean}} Scene */

const { PI, abs, atan2, ceil, cos, floor, hypot, max, min, sin } = Math;
const RAD = PI / 180;
const FAR = 2; // of the longer side, from the middle: what is farther away is not drawn
const LONGEST = 0.6; // of the longer side: a straight piece that is longer goes round the back
const CUT_OFF = 20; // points outside the view where something may still show a part of itself
const WHOLE_SPHERE = PI * 0.98;

export const MOVING = ['horizon', 'edge', 'tape', 'field'];
export const RESTING = ['state', 'dials', 'warnings'];

/** With nothing else on the view. @param {Definition} known @param {number} width
 * @param {number} height @param {string[]} [parts] @param {number[]} [inset] @returns {Place} */
export function placeOn(known, width, height, parts = [...MOVING, ...RESTING], inset = [0, 0]) {
  const { tape, margin, state } = known;
  const free = width - 2 * inset[0];
  const narrow = free < tape.narrow;
  const wanted = narrow ? free - 2 * margin : free * tape.share;
  const across = min(tape.most, max(wanted, min(tape.least, free - 2 * margin)));
  const rect = {
    x: (width - across) / 2, y: tape.top + inset[1], width: across, height: tape.height,
  };
  const below = rect.y + rect.height;
  return {
    width, height, tape: rect, sidesY: narrow ? below : inset[1],
    middleY: narrow ? below + margin + state.most * state.line - known.warnings.gap / 2 : below,
    parts, inset,
  };
}

/** What is drawn, in this order. @param {Definition} known @param {HudState} state
 * @param {Place} place @returns {Shape[]} */
export function shapes(known, state, place) {
  const scene = sceneOf(known, state, place);
  return place.parts.flatMap((part) => PARTS[part](scene));
}

/** @param {Definition} known @param {HudState} state @param {Place} place @returns {Scene} */
function sceneOf(known, state, place) {
  const headFromView = matrix(normalised(state.q) ?? [1, 0, 0, 0]);
  const levelFromHead = matrix(state.world ?? [1, 0, 0, 0]);
  return {
    known, state, place, headFromView, levelFromHead,
    focal: focalPx({ ...place, hfovDeg: state.hfovDeg, projection: state.projection }),
    cut: state.projection === 'crop',
    levelFromView: state.world ? matrixProduct(levelFromHead, headFromView) : headFromView,
    world: Boolean(state.world),
  };
}

/** @param {Piece[]} pieces @param {number} width @returns {Shape} */
const lines = (pieces, width, role = 'line', opacity = 1) =>
  ({ kind: 'lines', pieces, width, role, opacity });
/** @param {Rect} rect @returns {Shape} */
const box = (rect, role = 'box', opacity = 1) => ({ kind: 'box', rect, role, opacity });
/** @param {string} words @param {number} x @param {number} y @param {number} size
 * @returns {Shape} */
const text = (words, x, y, size, role = 'line', anchor = 'middle', opacity = 1) =>
  ({ kind: 'text', text: words, x, y, size, role, anchor, opacity });

/** @param {number} from @param {number} to @param {number} step @returns {number[]} */
const range = (from, to, step) =>
  Array.from({ length: max(0, floor((to - from) / step) + 1) }, (_, i) => from + i * step);
/** From -180 on, once around. @param {number} step */
const around = (step) => range(-180, 180 - step, step);

/** @param {number} yawDeg @param {number} pitchDeg @returns {Vector} to the right and up */
function direction(yawDeg, pitchDeg) {
  const [yaw, pitch] = [yawDeg * RAD, pitchDeg * RAD];
  return [sin(yaw) * cos(pitch), -sin(pitch), cos(yaw) * cos(pitch)];
}

/** @param {number[]} m @param {Vector} v the transposed matrix times v @returns {Vector} */
const back = (m, [x, y, z]) =>
  [m[0] * x + m[3] * y + m[6] * z, m[1] * x + m[4] * y + m[7] * z, m[2] * x + m[5] * y + m[8] * z];

/** @param {Scene} scene @returns {number} */
const longer = ({ place: { width, height } }) => max(width, height);

/** Place of a ray, level (the world's, or the vehicle's where that is not known) or the head's;
 * null far away. @param {Scene} scene @param {Vector} ray @returns {Point | null} */
function seen(scene, ray, level = true) {
  const { place, focal, state: { projection } } = scene;
  const at = placeOf(projection, back(level ? scene.levelFromView : scene.headFromView, ray));
  if (!at) return null;
  const [x, y] = [focal * at[0], focal * at[1]];
  const far = FAR * longer(scene);
  return abs(x) > far || abs(y) > far ? null : [place.width / 2 + x, place.height / 2 + y];
}

/** Without those that are nowhere, outside the view, or go round the back.
 * @param {Scene} scene @param {(Point | null)[]} starts @param {(Point | null)[]} ends
 * @returns {Piece[]} */
function pieces(scene, starts, ends) {
  const longest = LONGEST * longer(scene);
  const { width, height } = scene.place;
  const outside = (/** @type {number} */ a, /** @type {number} */ b, /** @type {number} */ most) =>
    max(a, b) <= -CUT_OFF || min(a, b) >= most + CUT_OFF;
  return starts.flatMap((from, i) => {
    const to = ends[i];
    if (!from || !to || outside(from[0], to[0], width) || outside(from[1], to[1], height)
      || hypot(to[0] - from[0], to[1] - from[1]) > longest) return [];
    return [/** @type {Piece} */ ([from[0], from[1], to[0], to[1]])];
  });
}

/** @param {Scene} scene @param {(Point | null)[]} points */
const path = (scene, points) => pieces(scene, points.slice(0, -1), points.slice(1));

/** Every other piece, if it is wanted. @param {Scene} scene @param {(Point | null)[]} points
 * @param {(i: number) => boolean} [wanted] by the number of its first point */
function dashed(scene, points, wanted = () => true) {
  const at = points.map((_, i) => i).filter((i) => i % 2 === 0 && i + 1 < points.length && wanted(i));
  return pieces(scene, at.map((i) => points[i]), at.map((i) => points[i + 1]));
}

/** Unless it is outside, or where the tape is. @param {Scene} scene @param {Point | null} point @param {string} words
 * @param {number} size @returns {Shape[]} */
function label({ place }, point, words, size, opacity = 1) {
  if (!point) return [];
  const [x, y] = point;
  const { tape: { x: left, y: top, width, height } } = place;
  const inside = -CUT_OFF < x && x < place.width + CUT_OFF
    && -CUT_OFF < y && y < place.height + CUT_OFF;
  const hidden = abs(x - left - width / 2) < width / 2 && y < top + height;
  return inside && !hidden ? [text(words, x, y, size, 'line', 'middle', opacity)] : [];
}

/** Lines of equal elevation, the level one with ticks, and the vehicle's nose.
 * @param {Scene} scene @returns {Shape[]} */
function horizon(scene) {
  if (scene.cut) return []; // only the lens knows where
  const { horizon: look, nose } = scene.known;
  const at = (/** @type {number} */ yaw, /** @type {number} */ pitch) =>
    seen(scene, direction(yaw, pitch));
  const level = (/** @type {number} */ pitch) =>
    range(-180, 180, look.step_deg).map((yaw) => at(yaw, pitch));
  const faint = look.ladder_opacity;
  const ticks = around(look.tick_deg).filter((yaw) => yaw !== 0);
  const up = (/** @type {number} */ yaw) =>
    (yaw % look.long_tick_deg === 0 ? look.long_tick_up_deg : look.tick_up_deg);
  return [
    lines(look.ladder_deg.flatMap((/** @type {number} */ pitch) =>
      dashed(scene, level(pitch), (i) => (i * look.step_deg - 180) % look.ladder_labels_deg !== 0)),
      look.ladder_width, 'line', faint),
    ...around(look.ladder_labels_deg).flatMap((yaw) =>
      look.ladder_deg.flatMap((/** @type {number} */ pitch) =>
        label(scene, at(yaw + look.step_deg / 2, pitch), `${signed(pitch)}°`, look.text, faint))),
    lines([...path(scene, level(0)),
      ...pieces(scene, ticks.map((yaw) => at(yaw, 0)), ticks.map((yaw) => at(yaw, up(yaw))))],
    look.width),
    ...around(look.label_deg).filter((yaw) => scene.world || yaw !== 0).flatMap((yaw) =>
      label(scene, at(yaw, look.label_up_deg), scene.world ? compass(yaw) : bearing(yaw), look.text)),
    lines(noseLines(scene, nose), nose.width, scene.world ? 'chosen' : 'line'),
  ];
}

/** The vehicle's: a ring, two wings and a fin. @param {Scene} scene @param {any} look */
function noseLines(scene, { ring_deg: ring, wing_deg: wing, fin_deg: fin }) {
  const at = (/** @type {number} */ yaw, /** @type {number} */ pitch) =>
    seen(scene, direction(yaw, pitch), false);
  const turns = range(0, 24, 1).map((i) => (i * PI) / 12);
  return [
    ...path(scene, turns.map((turn) => at(ring * cos(turn), ring * sin(turn)))),
    ...path(scene, [at(-wing, 0), at(-ring, 0)]), ...path(scene, [at(ring, 0), at(wing, 0)]),
    ...path(scene, [at(0, ring), at(0, fin)]),
  ];
}

/** Where the lens's field ends. @param {Scene} scene @returns {Shape[]} */
function edge(scene) {
  const { state: { lens }, known: { edge: look } } = scene;
  if (!lens || scene.cut || lens.thetaMax > WHOLE_SPHERE) return [];
  const sine = sin(lens.thetaMax);
  const points = range(0, 360, look.step_deg).map((degrees) => seen(scene,
    back(lens.cameraFromHead, [sine * cos(degrees * RAD), sine * sin(degrees * RAD), cos(lens.thetaMax)]),
    false));
  const found = dashed(scene, points);
  return found.length ? [lines(found, look.width, 'chosen', look.opacity)] : [];
}

/** Where the view points: heading in the world, or bearing from the vehicle's nose.
 * @param {Scene} scene @returns {Shape[]} */
function tape(scene) {
  const { known: { tape: look }, place: { tape: place } } = scene;
  const { yaw, pitch, roll } = angles(scene.levelFromView);
  const [middle, perDeg] = [place.x + place.width / 2, place.width / look.span_deg];
  const half = look.span_deg / 2;
  const shown = range(ceil((yaw - half) / 10) * 10, floor(yaw + half), 10)
    .map((degrees) => ({ degrees, x: middle + (degrees - yaw) * perDeg }));
  const long = (/** @type {number} */ degrees) => degrees % 30 === 0;
  const named = shown.filter(({ degrees, x }) => long(degrees) && abs(x - middle) > look.free
    && x > place.x + 14 && x < place.x + place.width - 14);
  const [wide, high] = look.readout;
  const frame = {
    x: middle - wide / 2, y: place.y + look.readout_y - high / 2, width: wide, height: high,
  };
  const readout = scene.world
    ? `${String(modulo(whole(modulo(yaw, 360)), 360)).padStart(3, '0')}°` : bearing(yaw, '°');
  return [
    lines(shown.map(({ degrees, x }) =>
      [x, place.y + 1, x, place.y + (long(degrees) ? look.long_tick : look.tick)]), look.width),
    ...named.map(({ degrees, x }) => text(scene.world ? compass(degrees) : bearing(degrees), x,
      place.y + look.label_y, look.text)),
    caret(scene, yaw, middle, perDeg),
    box(frame), lines(border(frame, look.width), look.width),
    lines([[middle, place.y + 0.5, middle, place.y + 9]], 2.5),
    text(readout, middle, place.y + look.readout_y, look.readout_text, 'bright'),
    ...readings(scene, pitch, roll, middle),
  ];
}

/** @param {Scene} scene @param {number} pitch @param {number} roll @param {number} middle
 * @returns {Shape[]} */
function readings({ known, place, world, headFromView }, pitch, roll, middle) {
  const { tape: look } = known;
  const frame = say(known, world ? 'world' : 'vehicle');
  const first = text(say(known, 'angles', { frame, pitch: signed(pitch), roll: signed(roll) }),
    middle, place.tape.y + look.lines_y[0], look.text);
  if (!world) return [first];
  const head = angles(headFromView);
  const words = say(known, 'head', { yaw: bearing(head.yaw, '°'), pitch: signed(head.pitch) });
  return [first, text(words, middle, place.tape.y + look.lines_y[1], look.text)];
}

/** Under the tape: where the vehicle's nose is; at the tape's end where it is beyond.
 * @param {Scene} scene @param {number} yaw @param {number} middle @param {number} perDeg
 * @returns {Shape} */
function caret({ known: { tape: look }, place: { tape: place }, levelFromHead }, yaw, middle, perDeg) {
  const away = modulo(angles(levelFromHead).yaw - yaw + 180, 360) - 180;
  const size = look.caret;
  const y = place.y + look.long_tick + 1;
  if (abs(away) <= look.span_deg / 2) {
    const x = middle + away * perDeg;
    return lines([[x - size, y + size, x, y], [x, y, x + size, y + size]], 2, 'chosen');
  }
  const way = away > 0 ? 1 : -1;
  const [x, low] = [middle + (way * place.width) / 2, y + size];
  return lines([[x - way * size, low - size, x, low], [x, low, x - way * size, low + size]], 2, 'chosen');
}

/** The whole field of the lens as a ring, and the border of the view in it.
 * @param {Scene} scene @returns {Shape[]} */
function field(scene) {
  const { known: { field: look, margin }, state: { lens, hfovDeg }, place } = scene;
  const { radius } = look;
  const start = place.inset[0] + margin;
  const [x, y] = [start + radius, place.height - place.inset[1] - margin - radius];
  const words = (/** @type {number} */ left) =>
    text(`${whole(hfovDeg)}°`, left, y, look.text, 'bright', 'left');
  if (!lens) return [words(start)];
  const ring = range(0, 36, 1).map((i) => /** @type {Point} */ (
    [x + radius * cos((i * PI) / 18), y + radius * sin((i * PI) / 18)]));
  /** @type {Piece[]} */
  const cross = [[x - 3, y, x + 3, y], [x, y - 3, x, y + 3]];
  const view = scene.cut ? []
    : [lines(path(scene, onRing(scene, lens, x, y)), look.width + 0.5, 'chosen')];
  return [lines([...path(scene, ring), ...cross], look.width), ...view,
    words(start + 2 * radius + 10)];
}

/** The view's border, as far from the middle as its directions are from the lens's axis.
 * @param {Scene} scene @param {{thetaMax: number, cameraFromHead: number[]}} lens
 * @param {number} x @param {number} y @returns {Point[]} */
function onRing(scene, lens, x, y) {
  const { known: { field: look }, place, focal, state: { projection } } = scene;
  const [right, bottom] = [place.width / 2 / focal, place.height / 2 / focal];
  const corners = [[-1, -1], [1, -1], [1, 1], [-1, 1], [-1, -1]];
  const points = corners.slice(0, -1).flatMap(([ax, ay], side) => {
    const [bx, by] = corners[side + 1];
    return range(0, look.steps - 1, 1).map((i) =>
      [ax + ((bx - ax) * i) / look.steps, ay + ((by - ay) * i) / look.steps]);
  });
  return [...points, corners[0]].map(([across, down]) => {
    const ray = rayOf(projection, across * right, down * bottom);
    const there = apply(lens.cameraFromHead, apply(scene.headFromView, ray));
    const sine = hypot(there[0], there[1]);
    const share = min(atan2(sine, there[2]) / lens.thetaMax, look.beyond);
    const scale = (look.radius * share) / max(sine, 1e-9);
    return [x + there[0] * scale, y + there[1] * scale];
  });
}

/** Link, tracker, mode, recording. @param {Scene} scene @returns {Shape[]} */
function stateLines({ known, state, place }) {
  const look = known.state;
  const x = known.margin + place.inset[0];
  const start = place.sidesY + known.margin + look.line / 2;
  const { link, tracker, mode = 'body', recording } = state;
  const told = [];
  if (link) {
    const lost = link.lost ? [say(known, 'lost', { n: link.lost })] : [];
    told.push([say(known, 'link', { state: link.state }), ...lost].join('  '));
  }
  if (tracker) told.push(tracker.state === 'tracking' ? tracker.name : `${tracker.name} ${tracker.state}`);
  if (mode !== 'body') told.push(mode);
  const shown = told.map((words, i) =>
    text(capitals(known, words), x, start + i * look.line, look.text, 'line', 'left'));
  if (recording?.state !== 'live') return shown;
  const y = start + told.length * look.line;
  return [...shown, lines([[x, y, x + look.dot, y]], look.dot, 'alert'),
    text(say(known, 'rec', { n: recording.shown }), x + look.dot + 6, y, look.text, 'alert', 'left')];
}

/** How late the head and the video are, as arcs from the left over the top.
 * @param {Scene} scene @returns {Shape[]} */
function dials({ known, state, place }) {
  const { dials: look, margin } = known;
  const y = place.sidesY + margin + look.radius + 2;
  const names = Object.keys(look.full_ms);
  const first = place.width - place.inset[0] - margin - look.radius - (names.length - 1) * look.step;
  return names.flatMap((name, i) => {
    const dial = state.dials?.[name];
    return dial ? dialShapes(known, name, dial, first + i * look.step, y) : [];
  });
}

/** @param {Definition} known @param {string} name @param {Dial} dial @param {number} x
 * @param {number} y @returns {Shape[]} */
function dialShapes(known, name, dial, x, y) {
  const { dials: look } = known;
  const role = { none: 'line', good: 'line', fair: 'chosen', poor: 'alert' }[level(known, name, dial)];
  const arcs = [{ value: dial.p95, opacity: 0.5 }, { value: dial.median, opacity: 1 }]
    .map(({ value, opacity }) => ({ share: min(1, (value ?? 0) / look.full_ms[name]), opacity }))
    .filter(({ share }) => share > 0);
  const value = dial.median === null ? say(known, 'none') : tenths(dial.median);
  return [
    lines(arc(look, x, y, 1), 1, 'line', look.track_opacity),
    ...arcs.map(({ share, opacity }) => lines(arc(look, x, y, share), look.width, role, opacity)),
    text(value, x, y - 1, look.text, 'bright'),
    text(say(known, `dial_${name}`), x, y + look.text - 1, look.label_text),
  ];
}

/** @param {Definition} known @param {string} name @param {Dial} dial
 * @returns {'none' | 'good' | 'fair' | 'poor'} */
export function level({ dials: { good_ms: goodMs } }, name, { median, p95 }) {
  if (median === null) return 'none';
  if ((p95 ?? 0) <= goodMs[name]) return 'good';
  return median <= 2 * goodMs[name] ? 'fair' : 'poor';
}

/** @param {any} look @param {number} x @param {number} y @param {number} share
 * @returns {Piece[]} */
function arc({ steps, radius }, x, y, share) {
  const count = max(2, ceil(steps * share) + 1);
  const points = range(0, count - 1, 1).map((i) => {
    const turn = PI * (1 + (share * i) / (count - 1));
    return [x + radius * cos(turn), y + radius * sin(turn)];
  });
  return points.slice(1).map((to, i) => [points[i][0], points[i][1], to[0], to[1]]);
}

/** @param {Scene} scene @returns {Shape[]} */
function warnings({ known, state, place }) {
  const { warnings: look, text: { advance }, margin } = known;
  const free = place.width - 2 * place.inset[0] - 2 * margin - 2 * look.pad;
  const most = max(8, floor(free / look.text / advance));
  return (state.warnings ?? []).slice(0, look.most).flatMap((warned, i) => {
    const y = place.middleY + look.gap + i * look.line;
    const words = shortened(capitals(known, warned.text), most);
    const role = { alert: 'alert', warn: 'chosen' }[warned.level] ?? 'line';
    const [wide, high] = [words.length * look.text * advance + 2 * look.pad, look.line - 6];
    const rect = { x: (place.width - wide) / 2, y: y - high / 2, width: wide, height: high };
    const frame = warned.level === 'alert' ? [lines(border(rect, 1.5), 1.5, role)] : [];
    return [box(rect), ...frame, text(words, place.width / 2, y, look.text, role)];
  });
}

/** Its lines, long enough for square corners. @param {Rect} rect @param {number} thick
 * @returns {Piece[]} */
function border({ x: left, y: top, width, height }, thick) {
  const [right, bottom] = [left + width, top + height];
  return [[left - thick / 2, top, right + thick / 2, top], [right, top, right, bottom],
    [right + thick / 2, bottom, left - thick / 2, bottom], [left, bottom, left, top]];
}

/** As quaternion.js has them. @param {number[]} m */
function angles(m) {
  const [xx, , xz, yx, yy, yz, zx, , zz] = m;
  const pitch = Math.asin(max(-1, min(1, -yz))) / RAD;
  if (abs(yz) > 1 - 1e-9) return { yaw: atan2(-zx, xx) / RAD, pitch, roll: 0 };
  return { yaw: atan2(xz, zz) / RAD, pitch, roll: atan2(yx, yy) / RAD };
}

/** @type {Record<string, (scene: Scene) => Shape[]>} */
const PARTS = {
  horizon, edge, tape, field, state: stateLines, dials, warnings,
};
