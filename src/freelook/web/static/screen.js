// The stage: which panes there are, and what is drawn in each.

import { MOVING, RESTING, placeOn, shapes } from './hud.js';
import * as instruments from './instruments.js';
import { panes, scaled, tapePlace } from './layout.js';
import { PROJECTIONS } from './projections.js';
import { IDENTITY } from './quaternion.js';
import { filled, outline, spanning } from './viewport.js';

/** @typedef {import('./quaternion.js').Quaternion} Quaternion */
/** @typedef {import('./viewport.js').Viewport} Viewport */
/** @typedef {import('./renderer.js').Rect} Rect */
/** @typedef {import('./hud.js').Shape} Shape */

// Where software draws: what two cores can draw 60 times a second, beside decoding the video.
const SOFTWARE_PIXELS = 640 * 360;
const GPU_PIXELS = 3840 * 2160;
const MOVING_MS = 50; // the head counts as moving for so long after its last change
const MOST_RATIO = 2;

export class Screen {
  /** @param {HTMLElement} stage @param {import('./renderer.js').Renderer} renderer
   * @param {import('./settings.js').Settings} settings @param {import('./zoom.js').Zoom} zoom
   * @param {import('./hud_words.js').Definition} hud */
  constructor(stage, renderer, settings, zoom, hud) {
    this.stage = stage;
    this.renderer = renderer;
    this.settings = settings;
    this.zoom = zoom;
    this.hud = hud;
    /** what the HUD tells beside where the view looks @type {Partial<import('./hud.js').HudState>} */
    this.told = {};
    /** @type {Quaternion | null} the vehicle's attitude in the frame that is shown */
    this.world = null;
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
    const { classList } = document.documentElement;
    classList.toggle('clean', !values.panels);
    classList.toggle('lines', values.instruments);
    const drawn = values.instruments && !values.panels ? JSON.stringify(this.told) : '';
    const key = [q, zoom.fieldDeg, this.projection, renderer.picture.version, renderer.grey, values.pip,
      values.split, values.instruments, values.hud, values.panels, this.world, drawn,
      stage.clientWidth, stage.clientHeight].join();
    if (key === this.drawnKey) return false;
    this.drawnKey = key;
    this.drawPanes(q);
    return true;
  }

  /** @param {Quaternion} q */
  drawPanes(q) {
    const { renderer, ratio, projection, settings: { values } } = this;
    const { main, forward, fisheye } = this.panes();
    const view = this.viewOn(main);
    renderer.clear();
    renderer.drawView(scaled(main, ratio), q, view.hfovDeg, projection);
    if (forward) {
      const { hfovDeg } = this.viewOn(forward);
      renderer.drawView(scaled(forward, ratio), IDENTITY, hfovDeg, projection);
    }
    renderer.pen.begin(ratio, values.hud);
    if (values.instruments) this.drawHud(main, view, q, fisheye);
    if (forward) renderer.pen.draw(caption('STRAIGHT AHEAD', forward), forward);
    renderer.pen.end();
    if (fisheye) this.drawFisheye(fisheye, view, q);
    instruments.showField(view.hfovDeg);
  }

  /** Beside the panels: what they do not show. Without them: everything.
   * @param {Rect} main @param {Viewport} view @param {Quaternion} q @param {Rect | null} fisheye */
  drawHud(main, view, q, fisheye) {
    const { renderer: { pen }, hud, settings: { values: { panels: beside } } } = this;
    const moving = MOVING.filter((part) => part !== 'field' || !(beside || fisheye));
    const place = beside ? this.placeBesidePanels(main)
      : placeOn(hud, main.width, main.height);
    const state = this.stateOf(view, q);
    pen.draw(shapes(hud, state, { ...place, parts: moving }), main);
    if (!beside) pen.draw(shapes(hud, state, { ...place, parts: RESTING }), main);
  }

  /** @param {Rect} main @returns {import('./hud.js').Place} */
  placeBesidePanels(main) {
    const place = placeOn(this.hud, main.width, main.height);
    const tape = tapePlace(main, [byId('top'), byId('readings')].map(rectOf), this.hud.tape);
    return { ...place, tape: { ...tape, x: tape.x - main.x, y: tape.y - main.y } };
  }

  /** The numbers that the HUD shows. @param {Viewport} view @param {Quaternion} q
   * @returns {import('./hud.js').HudState} */
  stateOf({ hfovDeg, projection = 'perspective' }, q) {
    const { profile } = this.renderer;
    const lens = {
      thetaMax: 2 * Math.atan(Math.sqrt(profile.tMax)), cameraFromHead: profile.cameraFromHead,
    };
    return { ...this.told, q, world: this.world, hfovDeg, projection, lens };
  }

  /** @param {Rect} rect @param {Viewport} view @param {Quaternion} q */
  drawFisheye(rect, view, q) {
    const { renderer, ratio, settings: { values } } = this;
    const { x, y, width, height } = renderer.drawFisheye(scaled(rect, ratio));
    const place = { x: x / ratio, y: y / ratio, width: width / ratio, height: height / ratio };
    renderer.pen.begin(ratio, values.hud);
    renderer.pen.draw(outlineOn(place, renderer.camera, view, q), place);
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

/** A word at a pane's foot. @param {string} text @param {Rect} pane @returns {Shape[]} */
const caption = (text, { height }) => [{
  kind: 'text', text, x: 12, y: height - 16, size: 12, role: 'line', anchor: 'left', opacity: 1,
}];

/** The view's border on the whole fisheye.
 * @param {Rect} place where the picture lies
 * @param {import('./camera.js').Camera} camera @param {Viewport} view @param {Quaternion} q
 * @returns {Shape[]} */
function outlineOn(place, camera, view, q) {
  const scale = [place.width / camera.size[0], place.height / camera.size[1]];
  const points = outline(view, q, camera).map((pixel) =>
    pixel && pixel.map((value, i) => (value + 0.5) * scale[i]));
  const pieces = points.slice(1).flatMap((to, i) => {
    const from = points[i];
    return from && to ? [/** @type {any} */ ([...from, ...to])] : [];
  });
  return [{ kind: 'lines', pieces, width: 2, role: 'chosen', opacity: 1 }];
}

const byId = (/** @type {string} */ id) => /** @type {HTMLElement} */ (document.getElementById(id));

/** @param {HTMLElement} element @returns {Rect} */
function rectOf(element) {
  const { x, y, width, height } = element.getBoundingClientRect();
  return { x, y, width, height };
}
