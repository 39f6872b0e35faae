// Which head is in command: the hand, the phone, or one of the station's trackers.
//
// Touching mouse, keys or gamepad takes over where the view points now; a button gives the
// command back. Recentre and enable go to whichever head is in command. Eyes front overrules them
// all, at once, and stays until it is released; so nothing need be heard from anybody for it.

import { Ease } from './ease.js';
import { storeLatches, storedLatches } from './latches.js';
import { afterLoss } from './loss.js';
import { IDENTITY, inverse, multiply, slerp } from './quaternion.js';

/** @typedef {import('./hand.js').Aim} Aim */

export class Command {
  /**
   * @param {object} heads
   * @param {import('./hand.js').HandHead} heads.hand @param {import('./phone.js').PhoneHead} heads.phone
   * @param {string[]} heads.trackers names
   * @param {import('./link.js').Link} link @param {() => import('./loss.js').Patience} patience
   * @param {typeof import('./station.js').control} control
   * @param {(message: string) => void} notify @param {number} [rateDegS] of changes that are eased
   */
  constructor({ hand, phone, trackers }, link, patience, control, notify, rateDegS = 240) {
    this.hand = hand;
    this.phone = phone;
    this.trackers = trackers;
    this.link = link;
    this.patience = patience;
    this.control = control;
    this.notify = notify;
    /** 'hand', 'phone' or 'tracker' */
    this.kind = trackers.length ? 'tracker' : 'hand';
    this.tracker = trackers[0] ?? '';
    /** @type {string | null} who had the command before the hand took it */
    this.before = null;
    /** in which heads turn in the frame that is shown; the vehicle's own axes: IDENTITY */
    this.base = IDENTITY;
    this.ease = new Ease(rateDegS);
    const latches = storedLatches();
    this.front = latches.front;
    hand.enabled = latches.hand;
    phone.enabled = latches.phone;
  }

  /** The name shown: you, phone, or the tracker's own. */
  get source() {
    return this.kind === 'tracker' ? this.tracker : this.kind;
  }

  /** Where the view looks, relative to the vehicle. @param {number} nowMs @returns {Aim} */
  aim(nowMs) {
    const aim = this.headAim(nowMs);
    return { ...aim, q: this.ease.apply(this.inVehicle(aim), nowMs) };
  }

  /** @param {Aim} aim @returns {import('./quaternion.js').Quaternion} */
  inVehicle({ q, based, left = IDENTITY, gone = 0 }) {
    const whole = based ? multiply(left, multiply(this.base, q)) : q;
    return gone ? slerp(whole, IDENTITY, gone) : whole;
  }

  /** @param {number} nowMs @returns {Aim} */
  headAim(nowMs) {
    if (this.front) return { q: IDENTITY, state: 'front', stampMs: null };
    if (this.kind === 'hand') return this.hand.aim();
    if (this.kind === 'phone') return this.phone.aim(nowMs);
    return this.trackerAim(nowMs);
  }

  /** @param {number} nowMs @returns {Aim} */
  trackerAim(nowMs) {
    const pose = this.link.poses.get(this.tracker);
    if (!pose) return { q: IDENTITY, state: 'waiting', stampMs: null };
    if (this.link.alive(nowMs)) return { ...pose };
    const ageMs = nowMs - (this.link.lastMs ?? pose.receivedMs);
    return { ...pose, ...afterLoss(ageMs / 1000, this.patience()), stampMs: null, ageMs };
  }

  /** What `change` does is eased. @param {() => void} change */
  gently(change) {
    const nowMs = performance.now();
    const before = this.aim(nowMs).q;
    change();
    this.ease.start(before, this.inVehicle(this.headAim(nowMs)), nowMs);
    storeLatches({ front: this.front, hand: this.hand.enabled, phone: this.phone.enabled });
  }

  /** Look forward at once; again: go on. */
  toggleFront() {
    if (this.front) return this.release();
    if (this.headAim(performance.now()).state === 'front') return this.ask('enable'); // the station's
    this.front = true;
    this.ease.stop();
    storeLatches({ front: true, hand: this.hand.enabled, phone: this.phone.enabled });
    this.notify('Eyes front');
  }

  release() {
    this.gently(() => {
      this.front = false;
    });
    this.notify('Following the head again');
  }

  /** Every input of mouse, touch, keys and gamepad goes through here.
   * @param {Partial<import('./quaternion.js').Angles>} by degrees @param {number} stampMs */
  turnByHand(by, stampMs) {
    if (this.front) return this.notify('Eyes front: Space or T goes on');
    this.takeByHand(stampMs);
    if (this.hand.enabled) this.hand.turn(by, stampMs);
    else this.notify('Head is switched off: T switches it on');
  }

  /** @param {number} stampMs */
  takeByHand(stampMs) {
    if (this.kind === 'hand' || this.front) return;
    this.hand.follow(multiply(inverse(this.base), this.aim(stampMs).q), stampMs);
    this.ease.stop();
    this.hand.enabled = true;
    this.before = this.source;
    this.kind = 'hand';
    this.notify('You have control');
  }

  /** @param {string} name 'hand', 'phone' or a tracker's */
  give(name) {
    if (name === 'hand') return this.takeByHand(performance.now());
    if (name !== 'phone' && !this.trackers.includes(name)) return;
    this.gently(() => {
      this.kind = name === 'phone' ? 'phone' : 'tracker';
      if (this.kind === 'tracker') this.tracker = name;
      this.before = null;
    });
    this.notify(`${name === 'phone' ? 'The phone' : name} has control`);
  }

  /** Back to who had it before the hand. */
  giveBack() {
    if (this.before) this.give(this.before);
  }

  async recentre() {
    if (this.kind !== 'tracker') this.ease.stop(); // at once: the pilot asked for it
    if (this.kind === 'hand') this.hand.recentre(performance.now());
    else if (this.kind === 'phone') this.phone.recentre();
    else return this.ask('recentre');
    this.notify('Recentred');
  }

  enabled() {
    if (this.kind !== 'tracker') return this[/** @type {'hand' | 'phone'} */ (this.kind)].enabled;
    return !['disabled', 'front'].includes(this.link.poses.get(this.tracker)?.state ?? '');
  }

  async toggle() {
    if (this.front) return this.release();
    if (this.kind === 'tracker') return this.ask(this.enabled() ? 'disable' : 'enable');
    const head = this.kind === 'hand' ? this.hand : this.phone;
    this.gently(() => {
      head.enabled = !head.enabled;
    });
    this.notify(head.enabled ? 'Head on' : 'Head off: looking straight ahead');
  }

  /** @param {'recentre' | 'enable' | 'disable'} action */
  async ask(action) {
    const why = await this.control(this.tracker, action);
    const done = { recentre: 'recentred', enable: 'switched on', disable: 'switched off' }[action];
    this.notify(why === null ? `${this.tracker} ${done}` : `${this.tracker}: ${why}`);
  }
}
