// Where things are drawn: rectangles in CSS pixels of the stage.

/** @typedef {import('./renderer.js').Rect} Rect */
/** @typedef {{main: Rect, forward: Rect | null, fisheye: Rect | null}} Panes
 * main: the pilot's view; forward: a view fixed straight ahead; fisheye: the whole picture */

export const SPLITS = /** @type {const} */ (['none', 'fisheye', 'forward']);

/** Side by side, or one above the other where the stage is upright.
 * @param {number} width @param {number} height @param {number} split index into SPLITS
 * @param {Rect | null} pip @returns {Panes} */
export function panes(width, height, split, pip) {
  const kind = SPLITS[split] ?? 'none';
  if (kind === 'none') {
    return { main: { x: 0, y: 0, width, height }, forward: null, fisheye: pip };
  }
  const [first, second] = halves(width, height);
  if (kind === 'fisheye') return { main: second, forward: null, fisheye: first };
  return { main: second, forward: first, fisheye: pip };
}

/** @param {number} width @param {number} height @returns {[Rect, Rect]} */
function halves(width, height) {
  if (width >= height) {
    const half = Math.floor(width / 2);
    return [
      { x: 0, y: 0, width: half, height }, { x: half, y: 0, width: width - half, height },
    ];
  }
  const half = Math.floor(height / 2);
  return [
    { x: 0, y: 0, width, height: half }, { x: 0, y: half, width, height: height - half },
  ];
}

/** @param {Rect} rect @param {number} ratio @returns {Rect} whole canvas pixels */
export function scaled({ x, y, width, height }, ratio) {
  const [left, top] = [Math.round(x * ratio), Math.round(y * ratio)];
  return {
    x: left,
    y: top,
    width: Math.max(2, Math.round((x + width) * ratio) - left),
    height: Math.max(2, Math.round((y + height) * ratio) - top),
  };
}

/** Where the tape of bearings goes: at the top of the pane between what stands there, else below.
 * @param {Rect} pane @param {Rect[]} boxes
 * @param {{most: number, least: number, height: number, top: number}} tape as hud.json has it
 * @returns {Rect} */
export function tapePlace(pane, boxes, { most, least, height, top: gap }) {
  const centre = pane.x + pane.width / 2;
  const near = boxes.filter((box) => box.y < pane.y + height && box.y + box.height > pane.y
    && box.x < pane.x + pane.width && box.x + box.width > pane.x);
  const room = Math.min(pane.width / 2, ...near.map((box) =>
    Math.max(box.x - centre, centre - box.x - box.width))) - gap;
  const fits = 2 * room >= least;
  const width = Math.min(most, fits ? 2 * room : pane.width - 2 * gap);
  const top = fits ? pane.y : Math.max(...near.map((box) => box.y + box.height));
  return { x: centre - width / 2, y: top + gap, width, height };
}
