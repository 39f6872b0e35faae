// The stage: which panes there are, and what is drawn in each.

import * as instruments from './instruments.js';
import { panes, scaled, tapePlace } from './layout.js';
import { drawCaption, drawHorizon, drawOutline, drawTape } from './overlay.js';
import { PROJECTIONS } from './projections.js';
import { IDENTITY } from './quaternion.js';
import { filled, spanning } from './viewport.js';

/** @typedef {import('./quaternion.js').Quaternion} Quaternion */
/** @typedef {import('./viewport.js').Viewport} Viewport */
/** @typedef {import('./renderer.js').Rect} Rect */

// Where software draws: what two cores can draw 60 times a second, beside decoding the video.
const SOFTWARE_PIXELS = 640 * 360;
const GPU_PIXELS = 3840 * 2160;
const MOVING_MS = 50; // the head counts as moving for so long after its last change
const MOST_RATIO = 2;

export class Screen {
  /** @param {HTMLElement} stage @param {import('./renderer.js').Renderer} renderer
   * @param {import('./settings.js').Settings} settings @param {import('./zoom.js').Zoom} zoom */
  constructor(stage, renderer, settings, zoom) {
    this.stage = stage;
    this.renderer = renderer;
    this.settings = settings;
    this.zoom = zoom;
    this.pip = byId('pip');
    this.pip.style.aspectRatio = renderer.profile.size.join(' / ');
    /** canvas pixels per CSS pixel */
    this.ratio = 1;
    const asked = Number(new URLSearchParams(location.search).get('pixels'));
    this.mostPixels = asked || (renderer.software ? SOFTWARE_PIXELS : GPU_PIXELS);
    this.drawnKey = '';
    this.drawnHead = '';
    this.movedMs = -Infinity;
  }

  /** Whether the head turned a moment ago. @param {number} nowMs */
  moving(nowMs) {
    return nowMs - this.movedMs < MOVING_MS;
  }

  panes() {
    const { clientWidth, clientHeight } = this.stage;
    const { pip, split } = this.settings.values;
    this.pip.hidden = !pip || split === 1;
    const made = panes(clientWidth, clientHeight, split, pip ? rectOf(this.pip) : null);
    const fill = (/** @type {Rect} */ pane) => filled(pane, this.zoom.fieldDeg, this.projection);
    return { ...made, main: fill(made.main), forward: made.forward && fill(made.forward) };
  }

  /** Of all views, by name. @returns {string} */
  get projection() {
    const wanted = this.settings.get('projection');
    return wanted in PROJECTIONS ? wanted : 'perspective';
  }

  /** @param {{width: number, height: number}} pane @returns {Viewport} */
  viewOn({ width, height }) {
    return spanning(width, height, this.zoom.fieldDeg, this.projection);
  }

  /** Draws unless the same is there already; returns whether it did.
   * @param {Quaternion} q @param {number} nowMs */
  draw(q, nowMs) {
    const head = q.join();
    if (head !== this.drawnHead) this.movedMs = nowMs;
    this.drawnHead = head;
    this.fitCanvas();
    this.zoom.use(this.projection);
    const { renderer, zoom, settings: { values }, stage } = this;
    const key = [q, zoom.fieldDeg, this.projection, renderer.picture.version, renderer.grey, values.pip,
      values.split, values.instruments, stage.clientWidth, stage.clientHeight].join();
    if (key === this.drawnKey) return false;
    this.drawnKey = key;
    this.drawPanes(q);
    return true;
  }

  /** @param {Quaternion} q */
  drawPanes(q) {
    const { renderer, ratio, projection } = this;
    const { main, forward, fisheye } = this.panes();
    const view = this.viewOn(main);
    renderer.clear();
    renderer.drawView(scaled(main, ratio), q, view.hfovDeg, projection);
    if (forward) {
      const { hfovDeg } = this.viewOn(forward);
      renderer.drawView(scaled(forward, ratio), IDENTITY, hfovDeg, projection);
    }
    renderer.pen.begin(ratio);
    if (this.settings.get('instruments')) this.drawLines(main, view, q);
    if (forward) drawCaption(renderer.pen, forward, 'STRAIGHT AHEAD');
    renderer.pen.end();
    if (fisheye) this.drawFisheye(fisheye, view, q);
    instruments.showField(view.hfovDeg);
  }

  /** @param {Rect} main @param {Viewport} view @param {Quaternion} q */
  drawLines(main, view, q) {
    const { pen } = this.renderer;
    if (view.projection !== 'crop') drawHorizon(pen, main, view, q); // only the lens knows where
    drawTape(pen, tapePlace(main, [byId('top'), byId('readings')].map(rectOf)), q);
  }

  /** @param {Rect} rect @param {Viewport} view @param {Quaternion} q */
  drawFisheye(rect, view, q) {
    const { renderer, ratio } = this;
    const { x, y, width, height } = renderer.drawFisheye(scaled(rect, ratio));
    const place = { x: x / ratio, y: y / ratio, width: width / ratio, height: height / ratio };
    renderer.pen.begin(ratio);
    drawOutline(renderer.pen, place, renderer.camera, view, q);
    renderer.pen.end();
  }

  /** Fewer canvas pixels where software draws; the browser enlarges. */
  fitCanvas() {
    const { clientWidth: width, clientHeight: height } = this.stage;
    const fitting = Math.sqrt(this.mostPixels / Math.max(1, width * height));
    this.ratio = Math.min(devicePixelRatio, MOST_RATIO, fitting);
    const { canvas } = this.renderer;
    const size = [width, height].map((length) => Math.max(1, Math.round(length * this.ratio)));
    this.zoom.spanPx = Math.max(...size);
    if (canvas.width !== size[0]) canvas.width = size[0];
    if (canvas.height !== size[1]) canvas.height = size[1];
  }
}

const byId = (/** @type {string} */ id) => /** @type {HTMLElement} */ (document.getElementById(id));

/** @param {HTMLElement} element @returns {Rect} */
function rectOf(element) {
  const { x, y, width, height } = element.getBoundingClientRect();
  return { x, y, width, height };
}
