// Letters as strokes, and a sheet of them at one size: how much of each pixel they cover. As
// freelook/hud/letters.py makes them of the same hud.json.

/** @typedef {{covered: Uint8Array, width: number, height: number, cell: [number, number],
 *   step: number, numbers: Map<string, number>, row: number}} Sheet
 * covered: the strokes, and the strokes with the rim; row: where it lies in the pen's texture */

const GRID = [8, 12];
const { ceil, floor, hypot, max, min } = Math;

/** @param {string} pens @returns {[number, number, number, number][]} on the grid */
const strokes = (pens) => pens.split('|').flatMap((line) => {
  const points = line.trim().split(/\s+/).map((point) => [...point].map((digit) => parseInt(digit, 16)));
  return points.slice(1).map((to, i) => /** @type {any} */ ([...points[i], ...to]));
});

/** @param {import('./hud_words.js').Definition} known @param {number} sizePx
 * @param {number} rimPx @param {number} weight @returns {Sheet} */
export function makeSheet({ text: look, letters }, sizePx, rimPx, weight) {
  const half = max(0.5, (sizePx * look.stroke * weight) / 2);
  const wide = max(2, floor(sizePx * look.width + 0.5)); // whole pixels: crisp strokes
  const high = 2 * max(1, floor((sizePx * look.height) / 2 + 0.5));
  const margin = ceil(rimPx + half + 0.5);
  /** @type {[number, number]} */
  const cell = [wide + 1 + 2 * margin, high + 1 + 2 * margin];
  const entries = Object.entries(letters);
  const sheet = {
    covered: new Uint8Array(2 * cell[0] * entries.length * cell[1]), width: cell[0] * entries.length,
    height: cell[1], cell, step: sizePx * look.advance,
    numbers: new Map(entries.map(([letter], i) => [letter, i])), row: 0,
  };
  const place = (/** @type {number} */ value, /** @type {0 | 1} */ axis) =>
    margin + 0.5 + (value * [wide, high][axis]) / GRID[axis];
  entries.forEach(([, pens], i) => {
    const ends = strokes(/** @type {string} */ (pens)).map(([x0, y0, x1, y1]) =>
      [place(x0, 0), place(y0, 1), place(x1, 0), place(y1, 1)]);
    cover(sheet, i * cell[0], ends, half, rimPx);
  });
  return sheet;
}

/** By how far the middle of each pixel is from the nearest stroke.
 * @param {Sheet} sheet @param {number} left @param {number[][]} ends @param {number} half
 * @param {number} rimPx */
function cover({ covered, width, cell }, left, ends, half, rimPx) {
  for (let row = 0; row < cell[1]; row += 1) {
    for (let column = 0; column < cell[0]; column += 1) {
      const away = min(...ends.map((end) => distance(column + 0.5, row + 0.5, end)));
      const at = 2 * (row * width + left + column);
      covered[at] = floor(255 * max(0, min(1, half + 0.5 - away)) + 0.5);
      covered[at + 1] = floor(255 * max(0, min(1, half + rimPx + 0.5 - away)) + 0.5);
    }
  }
}

/** @param {number} x @param {number} y @param {number[]} end */
function distance(x, y, [x0, y0, x1, y1]) {
  const [dx, dy] = [x1 - x0, y1 - y0];
  const length2 = dx * dx + dy * dy;
  const along = length2 > 0 ? max(0, min(1, ((x - x0) * dx + (y - y0) * dy) / length2)) : 0;
  return hypot(x - x0 - along * dx, y - y0 - along * dy);
}
