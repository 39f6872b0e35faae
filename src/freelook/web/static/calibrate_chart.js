// How the errors fall as views come in: pixels on a logarithmic scale, by the number of views.

/** @typedef {import('./calibrate_feed.js').Look} Look */

const SVG = 'http://www.w3.org/2000/svg';
const BOX = { left: 36, right: 232, top: 10, bottom: 128 };
const LINES = /** @type {const} */ ([
  ['sure', 'uncertainty_px'], ['left-out', 'left_out_px'], ['rms', 'rms_px'],
]);
const ROUND = [1, 2, 5];
const MOST_LABELS = 6; // with more ticks only powers of ten are labelled
const LEAST_RANGE = 4; // from the lowest to the highest tick

/** @param {string} name @param {Record<string, string | number>} attributes @param {string} [text] */
function element(name, attributes, text) {
  const made = document.createElementNS(SVG, name);
  for (const [key, value] of Object.entries(attributes)) made.setAttribute(key, String(value));
  if (text !== undefined) made.textContent = text;
  return made;
}

/** Round numbers (1, 2, 5, 10, ...) from just below all values to just above them.
 * @param {number[]} values all above 0 */
export function ticks(values) {
  const [least, most] = [Math.min(...values), Math.max(...values)];
  const start = Math.floor(Math.log10(least));
  const all = Array.from({ length: 3 * 16 }, (_, i) => ROUND[i % 3] * 10 ** (start + Math.floor(i / 3)));
  const first = all.filter((tick) => tick <= least * 1.0001).length - 1;
  const last = all.findIndex((tick) => tick >= Math.max(most, LEAST_RANGE * all[first]) * 0.9999);
  return all.slice(first, last + 1);
}

/** @param {SVGSVGElement} svg @param {Look['history']} history */
export function drawChart(svg, history) {
  const values = history.flatMap((entry) => LINES.map(([, key]) => entry[key]))
    .filter((value) => value !== null && value > 0);
  if (!values.length) {
    svg.replaceChildren(element('text', { x: 120, y: 78, 'text-anchor': 'middle' }, 'from 4 views on'));
    return;
  }
  const marks = ticks(/** @type {number[]} */ (values));
  const [low, high] = [marks[0], marks[marks.length - 1]].map(Math.log10);
  const first = history[0].views;
  const last = Math.max(history[history.length - 1].views, first + 4);
  const x = (/** @type {number} */ views) =>
    BOX.left + ((views - first) / (last - first)) * (BOX.right - BOX.left);
  const y = (/** @type {number} */ px) =>
    BOX.bottom - ((Math.log10(px) - low) / (high - low)) * (BOX.bottom - BOX.top);
  svg.replaceChildren(...axes(marks, first, last, x, y), ...LINES.flatMap(([name, key]) => {
    const points = history.filter((entry) => (entry[key] ?? 0) > 0)
      .map((entry) => [x(entry.views), y(/** @type {number} */ (entry[key]))]);
    const dots = points.slice(-1).map(([cx, cy]) => element('circle', { class: name, cx, cy, r: 3 }));
    return [element('polyline', { class: name, points: points.map((p) => p.join()).join(' ') }), ...dots];
  }));
}

/** @param {number[]} marks @param {number} first @param {number} last
 * @param {(views: number) => number} x @param {(px: number) => number} y */
function axes(marks, first, last, x, y) {
  const made = [];
  for (const mark of marks) {
    const at = y(mark);
    made.push(element('line', { class: 'grid', x1: BOX.left, x2: BOX.right, y1: at, y2: at }));
    const round = Math.abs(Math.log10(mark) % 1) < 1e-6;
    const label = round || marks.length <= MOST_LABELS ? String(Number(mark.toPrecision(2))) : '';
    made.push(element('text', { x: BOX.left - 5, y: at + 3.5, 'text-anchor': 'end' }, label));
  }
  for (const views of [first, last]) {
    const anchor = views === first ? 'start' : 'end';
    const text = views === last ? `${views} views` : `${views}`;
    made.push(element('text', { x: x(views), y: BOX.bottom + 15, 'text-anchor': anchor }, text));
  }
  return made;
}
