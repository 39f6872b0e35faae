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
