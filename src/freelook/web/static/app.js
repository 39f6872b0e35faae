// Wires the parts together and draws: the newest frame with the newest pose, at display rate,
// and nothing at all when neither changed.

import { Camera } from './camera.js';
import { Command } from './command.js';
import { STALE_S } from './conditions.js';
import { actionsOf, bindButtons, keysOf, makeHeadButtons } from './controls.js';
import { Gamepads } from './gamepad.js';
import { HandHead } from './hand.js';
import { notify } from './instruments.js';
import { Keyboard } from './keyboard.js';
import { Latency } from './latency.js';
import { LensLimit } from './limit.js';
import { Link } from './link.js';
import { fillPanel } from './panel.js';
import { PhoneHead } from './phone.js';
import { PointerInput } from './pointer.js';
import { inverse, multiply } from './quaternion.js';
import { Renderer } from './renderer.js';
import { framesReceived, report } from './report.js';
import { Screen } from './screen.js';
import { Settings } from './settings.js';
import { authorization, at, control, setMode } from './station.js';
import { VideoFeed } from './video.js';
import { WhepClient } from './whep.js';
import { Zoom } from './zoom.js';

/** @typedef {import('./video.js').FrameTimes} FrameTimes */

const LINK_LOST_MS = 3000; // silent for so long: start over
const TICK_MS = 250;

const byId = (/** @type {string} */ id) => /** @type {any} */ (document.getElementById(id));

export class App {
  /** @param {import('./station.js').Station} station @param {string} shaderBody
   * @param {import('./station.js').Hud} hud */
  constructor(station, shaderBody, hud) {
    this.station = station;
    this.hud = hud.known;
    this.notify = notify;
    this.wake = this.wake.bind(this);
    this.settings = new Settings({
      limit: station.limit, projection: station.projection ?? 'perspective',
      ...(station.hud === 'off' ? { instruments: false } : { hud: station.hud ?? 'day' }),
    });
    this.zoom = new Zoom(station.hfov_deg, station.zoom);
    this.renderer = new Renderer(byId('view'), shaderBody, new Camera(station.camera), hud);
    this.limit = new LensLimit(this.renderer.profile, station.rate_deg_s);
    this.screen = new Screen(byId('stage'), this.renderer, this.settings, this.zoom, hud.known);
    document.documentElement.classList.toggle('software', this.renderer.software);

    // Before there is a picture, poses are not worth the work of drawing.
    this.link = new Link(() => this.pictureMs !== null && this.posed(),
      (rtp) => this.frameTold(rtp));
    this.latency = new Latency(this.link);
    const patience = () => ({ holdS: station.hold_s, easeS: station.ease_s });
    this.hand = new HandHead();
    this.phone = new PhoneHead(this.settings, patience, this.wake);
    this.command = new Command(
      { hand: this.hand, phone: this.phone, trackers: station.trackers },
      this.link, patience, control, (text) => this.told(text), station.rate_deg_s,
    );
    /** @type {number | null} RTP time stamp of the frame in the textures */
    this.shownRtp = null;

    this.counts = { received: 0, drawn: 0, draws: 0 };
    /** @type {FrameTimes | null} of a picture not drawn yet */
    this.undrawn = null;
    /** @type {number | null} when the newest picture came into the textures */
    this.pictureMs = null;
    this.scheduled = 0;
    /** @type {HTMLVideoElement} */
    this.video = byId('video');
    this.feed = new VideoFeed(this.video, this.renderer.picture, this.uploadPath(),
      (times) => this.pictured(times));

    /** @type {import('./whep.js').WhepState} */
    this.whepState = 'connecting';
    this.whepMessage = '';
    this.connectedMs = 0;
    this.whep = new WhepClient(at('whep'), authorization, {
      onStream: (stream) => this.play(stream),
      onChannel: (channel) => this.link.attach(channel),
      onState: (state, message) => this.whepChanged(state, message),
    });

    const { command, zoom, settings, wake } = this;
    const actions = actionsOf(this);
    const viewport = () => this.screen.viewOn(this.screen.panes().main);
    this.pointer = new PointerInput(this.screen.stage, { command, zoom, settings, viewport, wake });
    this.keyboard = new Keyboard({ command, zoom, settings, wake, actions: keysOf(actions) });
    this.gamepads = new Gamepads({ command, zoom, settings, wake });
    bindButtons(actions, wake);
    makeHeadButtons(this);
    fillPanel(byId('settings-form'), settings, station.modes, this.hud, (mode) => this.setMode(mode));
    this.start();
  }

  start() {
    addEventListener('pagehide', () => this.whep.close());
    addEventListener('pageshow', () => this.whep.start());
    new ResizeObserver(this.wake).observe(this.screen.stage);
    this.whep.start();
    setInterval(() => this.tick(performance.now()), TICK_MS);
    this.tick(performance.now());
  }

  /** Software draws planes faster than the browser converts them; on a GPU it is the other way.
   * @returns {'planes' | 'rgb'} */
  uploadPath() {
    const asked = new URLSearchParams(location.search).get('upload');
    if (asked === 'planes' || asked === 'rgb') return asked;
    return this.renderer.software ? 'planes' : 'rgb';
  }

  /** @param {string} text */
  told(text) {
    notify(text);
    this.wake();
  }

  /** @param {MediaStream} stream */
  play(stream) {
    this.feed.play(stream).catch((error) => {
      if (error.name !== 'NotAllowedError') return; // a newer stream took over
      notify('Tap to start the video');
      addEventListener('pointerdown', () => this.video.play().catch(() => {}), { once: true });
    });
  }

  /** @param {import('./whep.js').WhepState} state @param {string} message */
  whepChanged(state, message) {
    // A failed attempt stays on the screen while the next one is made.
    const trying = state === 'connecting' && this.whepState === 'lost';
    if (!trying) [this.whepState, this.whepMessage] = [state, message];
    if (state === 'connected') this.connectedMs = performance.now();
    if (state === 'lost') this.feed.stop();
    report(this, performance.now());
  }

  /** The station told about a frame. @param {number} rtp */
  frameTold(rtp) {
    this.latency.frameTold(rtp);
    if (rtp === this.shownRtp) this.takeBase(); // it was drawn before we knew
  }

  /** Heads turn in the base of the frame that is shown, and the horizon is that of its time; of the
   * one before until there is word of it. */
  takeBase() {
    const world = this.link.worldOf(this.shownRtp);
    if (world !== undefined && String(world) !== String(this.screen.world)) {
      this.screen.world = world;
      this.wake();
    }
    const base = this.link.baseOf(this.shownRtp);
    if (!base || base.join() === this.command.base.join()) return;
    this.command.base = base;
    this.wake();
  }

  /** @param {string} mode of everybody's view */
  async setMode(mode) {
    const why = await setMode(mode);
    notify(why === null ? `Mode: ${mode}` : `Mode ${mode}: ${why}`);
  }

  /** The next one that is possible: `point` is not without something to point at. */
  async nextMode() {
    const { modes } = this.station;
    const now = modes.indexOf(this.link.status?.vehicle?.mode ?? modes[0]);
    for (const step of modes.keys()) {
      const mode = modes[(now + 1 + step) % modes.length];
      if (await setMode(mode) === null) return notify(`Mode: ${mode}`);
    }
    return notify('The station does not change its mode');
  }

  /** Where the view looks, within the lens if that is wanted.
   * @param {number} nowMs @returns {import('./hand.js').Aim} */
  aim(nowMs) {
    const aim = this.command.aim(nowMs);
    if (this.settings.get('limit') !== 'soft') {
      this.limit.holding = 0;
      return aim;
    }
    const view = this.screen.viewOn(this.screen.panes().main);
    return { ...aim, q: this.limit.apply(aim.q, view, nowMs) };
  }

  /** The hand stops where the lens ends: what it pushed beyond, it would have to pull back first.
   * @param {number} nowMs */
  keepHandInLens(nowMs) {
    const { command, hand } = this;
    if (command.source !== 'hand' || command.front || !hand.enabled) return;
    const whole = command.inVehicle(hand.aim());
    const kept = this.limit.stopped(whole, this.screen.viewOn(this.screen.panes().main), 0);
    if (kept !== whole) hand.follow(multiply(inverse(command.base), kept), hand.stampMs ?? nowMs);
  }

  /** A new picture lies in the textures. @param {FrameTimes} times */
  pictured(times) {
    this.undrawn = times;
    this.shownRtp = times.rtp;
    this.takeBase();
    this.pictureMs = performance.now();
    // Copying planes takes past this display frame's turn: do not wait for the next one.
    if (this.feed.path === 'planes') this.drawNow();
    else this.wake();
  }

  /** A new pose from the station. The first after a rest is drawn at once: nothing else is
   * under way. While the head moves, each display frame takes the newest. */
  posed() {
    if (this.screen.moving(performance.now())) this.wake();
    else this.drawNow();
  }

  /** Draw at the next display frame. */
  wake() {
    this.scheduled ||= requestAnimationFrame(() => this.drawNow());
  }

  drawNow() {
    cancelAnimationFrame(this.scheduled);
    this.scheduled = 0;
    const nowMs = performance.now();
    this.keyboard.advance(nowMs);
    this.gamepads.advance(nowMs);
    if (this.settings.get('limit') === 'soft') this.keepHandInLens(nowMs);
    const aim = this.aim(nowMs);
    const stale = this.pictureMs !== null && nowMs - this.pictureMs > STALE_S * 1000;
    this.renderer.grey = stale ? 1 : 0;
    if (this.screen.draw(aim.q, nowMs)) this.drawn(aim);
    const eased = aim.state === 'easing' || this.command.ease.active(nowMs) || this.limit.moving;
    if (this.keyboard.active || this.gamepads.active || eased) this.wake();
  }

  /** @param {import('./hand.js').Aim} aim */
  drawn(aim) {
    const nowMs = performance.now();
    this.counts.draws += 1;
    this.latency.poseDrawn(nowMs, aim.stampMs);
    if (!this.undrawn) return;
    this.counts.drawn += 1;
    this.latency.frameDrawn(nowMs, this.undrawn);
    this.undrawn = null;
  }

  /** @param {number} nowMs */
  async tick(nowMs) {
    this.watchLink(nowMs);
    this.wake();
    report(this, nowMs);
    this.counts.received = await framesReceived(this.whep.peer);
  }

  /** @param {number} nowMs */
  watchLink(nowMs) {
    if (this.whepState !== 'connected' || this.link.alive(nowMs)) return;
    const since = Math.max(this.link.lastMs ?? 0, this.connectedMs);
    if (nowMs - since > LINK_LOST_MS) this.whep.lost('it fell silent');
  }

  frameCounts() {
    const { presented } = this.feed;
    const pending = this.undrawn ? 1 : 0;
    return {
      received: Math.max(this.counts.received, presented),
      drawn: this.counts.drawn,
      dropped: Math.max(0, presented - this.counts.drawn - pending),
    };
  }
}
