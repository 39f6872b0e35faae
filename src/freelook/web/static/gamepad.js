// Gamepads: the right stick looks, either as a rate or as a direction. Standard mapping:
// https://w3c.github.io/gamepad/#remapping

const DEAD = 0.12;
const RATE_DEG_PER_S = 120;
const REACH_DEG = { yaw: 120, pitch: 70 };
const ZOOM_PER_S = 2;
const LONGEST_STEP_S = 0.1;
const BUTTONS = { recentre: [0, 11], toggle: [1, 9], front: [2, 3], narrower: [5, 7, 12], wider: [4, 6, 13] };

/** Nothing near the middle, then growing from 0; finer near the middle.
 * @param {number} value -1 to 1 */
export function stick(value) {
  const beyond = Math.max(0, Math.abs(value) - DEAD) / (1 - DEAD);
  return Math.sign(value) * beyond * beyond;
}

export class Gamepads {
  /**
   * @param {object} to
   * @param {import('./command.js').Command} to.command @param {import('./zoom.js').Zoom} to.zoom
   * @param {import('./settings.js').Settings} to.settings
   * @param {() => void} to.wake
   */
  constructor(to) {
    this.to = to;
    this.steppedMs = 0;
    /** the stick at the last step, when it gives directions */
    this.last = { x: 0, y: 0 };
    /** @type {Set<string>} buttons that were down at the last step */
    this.down = new Set();
    window.addEventListener('gamepadconnected', () => to.wake());
  }

  /** @returns {Gamepad | null} the first one there is */
  get pad() {
    return navigator.getGamepads?.().find((pad) => pad?.connected) ?? null;
  }

  /** Whether `advance` must be called at every display frame. */
  get active() {
    return this.pad !== null;
  }

  /** @param {number} nowMs */
  advance(nowMs) {
    const { pad } = this;
    if (!pad) return;
    const seconds = Math.min((nowMs - this.steppedMs) / 1000, LONGEST_STEP_S);
    this.steppedMs = nowMs;
    this.press(pad, seconds);
    const [x, y] = [stick(pad.axes[2] ?? 0), stick(pad.axes[3] ?? 0)];
    if (this.to.settings.get('stick') === 'position') this.point(x, y, nowMs);
    else if (x || y) this.turn(x, y, seconds, nowMs);
  }

  /** @param {number} x @param {number} y @param {number} seconds @param {number} nowMs */
  turn(x, y, seconds, nowMs) {
    const { command, settings, zoom } = this.to;
    const step = RATE_DEG_PER_S * seconds * Math.min(1, zoom.fieldDeg / 90);
    command.turnByHand({
      yaw: x * step * settings.gain('gamepad', 'yaw'),
      pitch: -y * step * settings.gain('gamepad', 'pitch'),
    }, nowMs);
  }

  /** @param {number} x @param {number} y @param {number} nowMs */
  point(x, y, nowMs) {
    const { command, settings } = this.to;
    if (x === this.last.x && y === this.last.y) return;
    this.last = { x, y };
    command.takeByHand(nowMs);
    command.turnByHand({
      yaw: x * REACH_DEG.yaw * settings.gain('gamepad', 'yaw') - command.hand.angles.yaw,
      pitch: -y * REACH_DEG.pitch * settings.gain('gamepad', 'pitch') - command.hand.angles.pitch,
    }, nowMs);
  }

  /** @param {Gamepad} pad @param {number} seconds */
  press(pad, seconds) {
    const { command, zoom } = this.to;
    const pressed = new Set(Object.entries(BUTTONS)
      .filter(([, numbers]) => numbers.some((n) => pad.buttons[n]?.pressed))
      .map(([name]) => name));
    if (pressed.has('recentre') && !this.down.has('recentre')) command.recentre();
    if (pressed.has('toggle') && !this.down.has('toggle')) command.toggle();
    if (pressed.has('front') && !this.down.has('front')) command.toggleFront();
    if (pressed.has('narrower')) zoom.by(ZOOM_PER_S ** -seconds);
    if (pressed.has('wider')) zoom.by(ZOOM_PER_S ** seconds);
    this.down = pressed;
  }
}
