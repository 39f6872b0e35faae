// Held keys turn the head and zoom; pressed keys do things. Time is an argument of `advance`.

/** Per second, as a share of the field of view. */
const LOOK_PER_S = 0.8;
const ROLL_DEG_PER_S = 45;
const ZOOM_PER_S = 2;
const LONGEST_STEP_S = 0.1;

/** @type {Record<string, [axis: 'yaw' | 'pitch' | 'roll' | 'zoom', way: number]>} */
const HELD = {
  ArrowLeft: ['yaw', -1], KeyA: ['yaw', -1], ArrowRight: ['yaw', 1], KeyD: ['yaw', 1],
  ArrowUp: ['pitch', 1], KeyW: ['pitch', 1], ArrowDown: ['pitch', -1], KeyS: ['pitch', -1],
  KeyQ: ['roll', -1], KeyE: ['roll', 1],
  Equal: ['zoom', -1], NumpadAdd: ['zoom', -1], Minus: ['zoom', 1], NumpadSubtract: ['zoom', 1],
};

export class Keyboard {
  /**
   * @param {object} to
   * @param {import('./command.js').Command} to.command @param {import('./zoom.js').Zoom} to.zoom
   * @param {import('./settings.js').Settings} to.settings
   * @param {Record<string, () => void>} to.actions by KeyboardEvent.code
   * @param {() => void} to.wake
   */
  constructor(to) {
    this.to = to;
    /** @type {Set<string>} */
    this.held = new Set();
    /** @type {number | null} time of the last step */
    this.steppedMs = null;
    window.addEventListener('keydown', (event) => this.press(event));
    window.addEventListener('keyup', (event) => this.held.delete(codeOf(event)));
    window.addEventListener('blur', () => this.held.clear());
  }

  /** @param {KeyboardEvent} event */
  press(event) {
    if (event.ctrlKey || event.metaKey || event.altKey || isField(event.target)) return;
    const code = codeOf(event);
    if (code in HELD) {
      if (!this.held.size) this.steppedMs = event.timeStamp;
      this.held.add(code);
      event.preventDefault();
      this.to.wake();
    } else if (code in this.to.actions && !event.repeat) {
      event.preventDefault();
      this.to.actions[code]();
      this.to.wake();
    }
  }

  /** Whether `advance` must be called at every display frame. */
  get active() {
    return this.held.size > 0;
  }

  /** @param {number} nowMs */
  advance(nowMs) {
    if (!this.active) return;
    const seconds = Math.min((nowMs - (this.steppedMs ?? nowMs)) / 1000, LONGEST_STEP_S);
    this.steppedMs = nowMs;
    if (seconds <= 0) return;
    const { command, zoom, settings } = this.to;
    const way = { yaw: 0, pitch: 0, roll: 0, zoom: 0 };
    for (const code of this.held) way[HELD[code][0]] += HELD[code][1];
    if (way.zoom) zoom.by(ZOOM_PER_S ** (way.zoom * seconds));
    if (!way.yaw && !way.pitch && !way.roll) return;
    const look = LOOK_PER_S * zoom.fieldDeg * seconds;
    command.turnByHand({
      yaw: way.yaw * look * settings.gain('keys', 'yaw'),
      pitch: way.pitch * look * settings.gain('keys', 'pitch'),
      roll: way.roll * ROLL_DEG_PER_S * seconds * settings.gain('keys', 'roll'),
    }, nowMs);
  }
}

/** '+' and '-' lie elsewhere on many keyboards. @param {KeyboardEvent} event */
function codeOf(event) {
  return { '+': 'Equal', '-': 'Minus' }[event.key] ?? event.code;
}

/** @param {EventTarget | null} target */
const isField = (target) =>
  target instanceof HTMLInputElement || target instanceof HTMLSelectElement;
