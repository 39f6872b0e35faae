// Draws the camera's picture with what was found in it and where to hold the board next, and the
// map of what has been seen. Every line has a dark edge, so that it shows on anything.

/** @typedef {import('./calibrate_feed.js').Look} Look */
/** @typedef {import('./calibrate_feed.js').Point} Point */

const GREEN = '#8dffc5';
const AMBER = '#ffd166';
const WHITE = '#f4fffb';
const DARK = 'rgba(0, 12, 10, 0.75)';
/** how a found board is drawn, by the verdict */
const COLORS = { taken: GREEN, known: GREEN, many: GREEN, moving: WHITE };

/** Makes the canvas as large as it is shown; canvas pixels per picture pixel, and the offset.
 * @param {HTMLCanvasElement} canvas @param {Point} size */
export function fitted(canvas, [width, height]) {
  const ratio = Math.min(devicePixelRatio || 1, 2);
  const [w, h] = [Math.round(canvas.clientWidth * ratio), Math.round(canvas.clientHeight * ratio)];
  if (canvas.width !== w || canvas.height !== h) [canvas.width, canvas.height] = [w, h];
  const scale = Math.min(w / width, h / height);
  return { scale, x: (w - width * scale) / 2, y: (h - height * scale) / 2, ratio };
}

export class Pencil {
  /** Draws in pixels of the picture: (0, 0) is the middle of its first pixel.
   * @param {HTMLCanvasElement} canvas @param {Point} size */
  constructor(canvas, size) {
    this.place = fitted(canvas, size);
    this.context = /** @type {CanvasRenderingContext2D} */ (canvas.getContext('2d'));
    this.context.setTransform(1, 0, 0, 1, 0, 0);
    this.context.clearRect(0, 0, canvas.width, canvas.height);
    this.context.lineJoin = 'round';
    this.context.lineCap = 'round';
  }

  /** @param {Point} pixel @returns {Point} on the canvas */
  at([x, y]) {
    const { scale, x: left, y: top } = this.place;
    return [left + (x + 0.5) * scale, top + (y + 0.5) * scale];
  }

  /** @param {ImageBitmap} picture @param {Point} size */
  picture(picture, [width, height]) {
    const { scale, x, y } = this.place;
    this.context.drawImage(picture, x, y, width * scale, height * scale);
  }

  /** @param {(Point | null)[]} points @param {boolean} closed */
  path(points, closed) {
    const { context } = this;
    context.beginPath();
    let down = false;
    for (const point of points) {
      if (point) context[down ? 'lineTo' : 'moveTo'](...this.at(point));
      down = point !== null;
    }
    if (closed && points.every((point) => point)) context.closePath();
  }

  /** @param {(Point | null)[]} points @param {string} color @param {number} width CSS pixels
   * @param {{closed?: boolean, dash?: number[], halo?: boolean}} [how] */
  line(points, color, width, { closed = false, dash = [], halo = true } = {}) {
    const { context, place: { ratio } } = this;
    this.path(closed ? [...points, points[0]] : points, closed);
    context.setLineDash([]);
    if (halo) this.stroke(DARK, (width + 2.5) * ratio);
    context.setLineDash(dash.map((part) => part * ratio));
    this.stroke(color, width * ratio);
    context.setLineDash([]);
  }

  /** @param {string} color @param {number} width */
  stroke(color, width) {
    this.context.strokeStyle = color;
    this.context.lineWidth = width;
    this.context.stroke();
  }

  /** @param {(Point | null)[]} points @param {string} color */
  area(points, color) {
    this.path(points, true);
    this.context.fillStyle = color;
    this.context.fill();
  }

  /** @param {Point} point @param {number} radius CSS pixels @param {string} color */
  dot(point, radius, color) {
    const { context, place: { ratio } } = this;
    for (const [r, style] of /** @type {[number, string][]} */ ([[radius + 1.2, DARK], [radius, color]])) {
      context.beginPath();
      context.arc(...this.at(point), r * ratio, 0, 2 * Math.PI);
      context.fillStyle = style;
      context.fill();
    }
  }

  /** Part of a ring, from the top. @param {Point} point @param {number} share */
  ring(point, share) {
    const { context, place: { ratio } } = this;
    const turn = (/** @type {number} */ part) => (part - 0.25) * 2 * Math.PI;
    context.beginPath();
    context.arc(...this.at(point), 22 * ratio, turn(0), turn(1));
    this.stroke(DARK, 9 * ratio);
    context.beginPath();
    context.arc(...this.at(point), 22 * ratio, turn(0), turn(share));
    this.stroke(share >= 1 ? GREEN : AMBER, 6 * ratio);
  }

  /** @param {Point} from @param {Point} to picture pixels */
  arrow(from, to) {
    const { scale, ratio } = this.place;
    const [dx, dy] = [to[0] - from[0], to[1] - from[1]];
    const length = Math.hypot(dx, dy);
    const head = Math.min((16 * ratio) / scale, length / 2);
    const [ux, uy] = [dx / length, dy / length];
    const side = (/** @type {number} */ way) => /** @type {Point} */ ([
      to[0] - head * (ux - 0.6 * way * uy), to[1] - head * (uy + 0.6 * way * ux)]);
    this.line([from, to, null, side(1), to, side(-1)], AMBER, 4);
  }
}

/** @param {(Point | null)[]} points @returns {Point | null} */
export function middle(points) {
  const known = /** @type {Point[]} */ (points.filter((point) => point));
  if (!known.length) return null;
  const sum = known.reduce(([a, b], [x, y]) => [a + x, b + y], [0, 0]);
  return [sum[0] / known.length, sum[1] / known.length];
}

/** @param {HTMLCanvasElement} canvas @param {ImageBitmap | null} picture @param {Look} look
 * @param {boolean} guided whether to show where to hold the board */
export function drawCamera(canvas, picture, look, guided) {
  const pencil = new Pencil(canvas, look.size);
  if (picture) pencil.picture(picture, look.size);
  if (!guided) return;
  const here = middle(look.corners);
  if (look.hold) drawHold(pencil, look, here);
  const color = COLORS[/** @type {keyof typeof COLORS} */ (look.verdict)] ?? AMBER;
  for (const corner of look.corners) pencil.dot(corner, 2.6, color);
  if (here && look.held > 0) pencil.ring(here, look.held);
}

/** @param {Pencil} pencil @param {Look} look @param {Point | null} here */
function drawHold(pencil, { hold, sectors }, here) {
  if (!hold) return;
  if (hold.sector !== null) pencil.area(sectors[hold.sector], 'rgba(255, 209, 102, 0.13)');
  pencil.line(hold.outline, AMBER, 2.5, { closed: true, dash: [9, 6] });
  const there = middle(hold.outline);
  if (!here || !there) return;
  const [dx, dy] = [there[0] - here[0], there[1] - here[1]];
  const length = Math.hypot(dx, dy);
  const gap = (30 * pencil.place.ratio) / pencil.place.scale;
  if (length < 2.5 * gap) return;
  const away = (/** @type {Point} */ [x, y], /** @type {number} */ by) => /** @type {Point} */ (
    [x + (dx / length) * by, y + (dy / length) * by]);
  pencil.arrow(away(here, gap), away(there, -gap / 2));
}

/** @param {HTMLCanvasElement} canvas @param {Look} look */
export function drawMap(canvas, look) {
  const pencil = new Pencil(canvas, look.size);
  const [width, height] = look.size;
  const border = /** @type {Point[]} */ (
    [[-0.5, -0.5], [width - 0.5, -0.5], [width - 0.5, height - 0.5], [-0.5, height - 0.5]]);
  pencil.line(border, 'rgba(255, 255, 255, 0.3)', 1, { closed: true, halo: false });
  look.sectors.forEach((sector, number) => {
    if (look.filled[number]) pencil.area(sector, 'rgba(60, 200, 140, 0.5)');
  });
  for (const sector of look.sectors) {
    pencil.line(sector, 'rgba(190, 230, 215, 0.45)', 1, { closed: true, halo: false });
  }
  for (const outline of look.outlines) {
    pencil.line(outline, 'rgba(244, 255, 251, 0.75)', 1, { closed: true, halo: false });
  }
  const asked = look.hold?.sector;
  if (asked !== null && asked !== undefined) {
    pencil.line(look.sectors[asked], AMBER, 2.5, { closed: true });
  }
  const here = middle(look.corners);
  if (here) pencil.dot(here, 4, WHITE);
}
