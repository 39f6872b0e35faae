// What the user chose, kept in localStorage: direction and scale of each input.

const KEY = 'freelook.settings';

export const INPUTS = /** @type {const} */ ({
  drag: { title: 'Mouse and touch', axes: ['yaw', 'pitch'] },
  keys: { title: 'Keyboard', axes: ['yaw', 'pitch', 'roll'] },
  gamepad: { title: 'Gamepad', axes: ['yaw', 'pitch'] },
  phone: { title: 'Phone sensor', axes: ['yaw', 'pitch', 'roll'] },
});

const DEFAULTS = {
  dragMoves: 'picture', // or 'head'
  stick: 'rate', // or 'position'
  pip: true,
  split: 0,
  instruments: true, // the HUD
  hud: 'day',
  panels: true,
};

export class Settings {
  /** @param {Record<string, any>} [usual] what the station wants where the user chose nothing */
  constructor(usual = {}, storage = safeStorage()) {
    this.storage = storage;
    this.usual = { ...DEFAULTS, ...usual };
    /** @type {Record<string, any>} */
    this.values = { ...this.usual, ...stored(storage) };
  }

  /** @param {string} name */
  get(name) {
    return this.values[name];
  }

  /** @param {string} name @param {any} value */
  set(name, value) {
    this.values[name] = value;
    try {
      this.storage?.setItem(KEY, JSON.stringify(this.values));
    } catch {
      // full or forbidden: the choice holds until the page is closed
    }
  }

  /** Scale of an axis, negative when inverted. @param {string} input @param {string} axis */
  gain(input, axis) {
    const scale = Number(this.values[`${input}.${axis}.scale`] ?? 1);
    const sign = this.values[`${input}.${axis}.invert`] ? -1 : 1;
    return sign * (Number.isFinite(scale) ? scale : 1);
  }

  /** Degrees that a head may turn before the view does. @param {string} input @param {string} axis */
  deadZone(input, axis) {
    const degrees = Number(this.values[`${input}.${axis}.dead`] ?? 0);
    return Number.isFinite(degrees) ? Math.max(0, degrees) : 0;
  }

  reset() {
    this.values = { ...this.usual };
    this.storage?.removeItem(KEY);
  }
}

/** @returns {Storage | null} null where the browser forbids it */
function safeStorage() {
  try {
    return window.localStorage;
  } catch {
    return null;
  }
}

/** @param {Storage | null} storage @returns {Record<string, any>} */
function stored(storage) {
  try {
    const values = JSON.parse(storage?.getItem(KEY) ?? '{}');
    return values && typeof values === 'object' ? values : {};
  } catch {
    return {};
  }
}
