// Mouse and touch. One pointer drags the view: the picture follows the finger (settings: or the
// head does, the other way round). Two pinch to zoom. The wheel zooms.

import { focalPx } from './viewport.js';

const DEG = 180 / Math.PI;
const STEEP = 0.2; // near straight up or down yaw is not driven faster than 1 / STEEP

/** Head angles for a drag of (dx, dy) view pixels that keeps the picture under the finger; exact
 * in the middle of the view. @param {number} dx @param {number} dy
 * @param {import('./viewport.js').Viewport} view @param {import('./quaternion.js').Angles} head */
export function dragged(dx, dy, view, { pitch, roll }) {
  const [cos, sin] = [Math.cos(roll / DEG), Math.sin(roll / DEG)];
  const [level, upright] = [cos * dx - sin * dy, sin * dx + cos * dy]; // undo the head's roll
  const degPerPx = DEG / focalPx(view);
  return {
    yaw: (-level * degPerPx) / Math.max(Math.cos(pitch / DEG), STEEP),
    pitch: upright * degPerPx,
  };
}

export class PointerInput {
  /**
   * @param {HTMLElement} surface
   * @param {object} to
   * @param {import('./command.js').Command} to.command @param {import('./zoom.js').Zoom} to.zoom
   * @param {import('./settings.js').Settings} to.settings
   * @param {() => import('./viewport.js').Viewport} to.viewport in CSS pixels
   * @param {() => void} to.wake
   */
  constructor(surface, to) {
    this.surface = surface;
    this.to = to;
    /** @type {Map<number, {x: number, y: number}>} */
    this.down = new Map();
    surface.addEventListener('pointerdown', (event) => this.press(event));
    surface.addEventListener('pointermove', (event) => this.move(event));
    for (const end of ['pointerup', 'pointercancel', 'lostpointercapture']) {
      surface.addEventListener(end, (event) =>
        this.down.delete(/** @type {PointerEvent} */ (event).pointerId));
    }
    surface.addEventListener('wheel', (event) => this.wheel(event), { passive: false });
  }

  /** @param {PointerEvent} event */
  press(event) {
    if (event.pointerType === 'mouse' && event.button !== 0) return;
    if (event.isTrusted) this.surface.setPointerCapture(event.pointerId);
    this.down.set(event.pointerId, { x: event.clientX, y: event.clientY });
  }

  /** @param {PointerEvent} event */
  move(event) {
    const before = this.down.get(event.pointerId);
    if (!before) return;
    const spread = this.spread();
    this.down.set(event.pointerId, { x: event.clientX, y: event.clientY });
    if (this.down.size === 1) {
      this.drag(event.clientX - before.x, event.clientY - before.y, event.timeStamp);
    } else if (spread > 0 && this.spread() > 0) {
      this.to.zoom.by(spread / this.spread());
    }
    this.to.wake();
  }

  /** @param {number} dx @param {number} dy @param {number} stampMs */
  drag(dx, dy, stampMs) {
    const { command, settings, viewport } = this.to;
    command.takeByHand(stampMs);
    const turn = dragged(dx, dy, viewport(), command.hand.angles);
    const way = settings.get('dragMoves') === 'head' ? -1 : 1;
    command.turnByHand({
      yaw: turn.yaw * way * settings.gain('drag', 'yaw'),
      pitch: turn.pitch * way * settings.gain('drag', 'pitch'),
    }, stampMs);
  }

  /** Distance between the first two fingers, 0 with fewer. */
  spread() {
    const [a, b] = [...this.down.values()];
    return b ? Math.hypot(a.x - b.x, a.y - b.y) : 0;
  }

  /** @param {WheelEvent} event */
  wheel(event) {
    event.preventDefault();
    const lines = event.deltaMode === WheelEvent.DOM_DELTA_PIXEL ? event.deltaY / 100 : event.deltaY / 3;
    this.to.zoom.by(1.1 ** Math.max(-3, Math.min(3, lines)));
    this.to.wake();
  }
}
