// The rectified view at the end: the flight page's renderer with the camera just calibrated.

import { Camera } from './camera.js';
import { fitted } from './calibrate_draw.js';
import { dragged } from './pointer.js';
import { fromAngles } from './quaternion.js';
import { Renderer } from './renderer.js';
import { getShader } from './station.js';
import { spanning } from './viewport.js';
import { Zoom } from './zoom.js';

const START_DEG = 90;
const KEYS = /** @type {Record<string, [number, number]>} */ ({
  ArrowLeft: [-5, 0], ArrowRight: [5, 0], ArrowUp: [0, 5], ArrowDown: [0, -5],
});

export class RectifiedView {
  /** @param {HTMLCanvasElement} canvas */
  constructor(canvas) {
    this.canvas = canvas;
    this.zoom = new Zoom(START_DEG);
    this.angles = { yaw: 0, pitch: 0, roll: 0 };
    this.drawn = 0;
    /** @type {Renderer | null} */
    this.renderer = null;
    canvas.addEventListener('pointerdown', (event) => {
      if (event.isTrusted) canvas.setPointerCapture(event.pointerId);
    });
    canvas.addEventListener('pointermove', (event) => event.buttons & 1 && this.drag(event));
    canvas.addEventListener('keydown', (event) => this.press(event));
    canvas.addEventListener('wheel', (event) => {
      event.preventDefault();
      this.turned(() => this.zoom.by(1.1 ** Math.sign(event.deltaY)));
    }, { passive: false });
  }

  /** Throws where WebGL2 is missing. @param {import('./camera.js').CameraJson} json */
  async use(json) {
    this.renderer = new Renderer(this.canvas, await getShader(), new Camera(json));
    this.angles = { yaw: 0, pitch: 0, roll: 0 };
  }

  get viewport() {
    return spanning(this.canvas.width, this.canvas.height, this.zoom.fieldDeg);
  }

  /** @param {ImageBitmap} picture */
  show(picture) {
    if (!this.renderer) return;
    // @ts-ignore: WebGL takes a bitmap as it does a video frame
    this.renderer.picture.uploadFrame(picture, picture.width, picture.height);
    this.draw();
  }

  draw() {
    if (!this.renderer) return;
    const { canvas, renderer } = this;
    fitted(canvas, [1, 1]);
    renderer.clear();
    const place = { x: 0, y: 0, width: canvas.width, height: canvas.height };
    renderer.drawView(place, fromAngles(this.angles), this.viewport.hfovDeg);
    this.drawn += 1;
  }

  /** @param {PointerEvent} event */
  drag({ movementX, movementY }) {
    const ratio = this.canvas.width / this.canvas.clientWidth;
    const { yaw, pitch } = dragged(movementX * ratio, movementY * ratio, this.viewport, this.angles);
    this.turned(() => this.turn(yaw, pitch));
  }

  /** @param {KeyboardEvent} event */
  press(event) {
    const zoom = { '+': 1 / 1.15, '-': 1.15 }[event.key];
    const way = KEYS[event.key];
    if (!zoom && !way) return;
    event.preventDefault();
    this.turned(() => (zoom ? this.zoom.by(zoom) : this.turn(...way)));
  }

  /** @param {number} yaw @param {number} pitch degrees */
  turn(yaw, pitch) {
    this.angles.yaw += yaw;
    this.angles.pitch = Math.max(-90, Math.min(90, this.angles.pitch + pitch));
  }

  /** @param {() => void} change */
  turned(change) {
    change();
    requestAnimationFrame(() => this.draw());
  }
}
