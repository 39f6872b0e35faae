// Wires the parts together and draws: the newest frame with the newest pose, at display rate,
// and nothing at all when neither changed.

import { Command } from './command.js';
import { STALE_S, conditions } from './conditions.js';
import { Gamepads } from './gamepad.js';
import { HandHead } from './hand.js';
import * as instruments from './instruments.js';
import { Keyboard } from './keyboard.js';
import { Latency } from './latency.js';
import { panes, scaled, tapePlace } from './layout.js';
import { Link } from './link.js';
import { drawCaption, drawHorizon, drawOutline, drawTape } from './overlay.js';
import { fillPanel } from './panel.js';
import { PhoneHead } from './phone.js';
import { PointerInput } from './pointer.js';
import { Renderer } from './renderer.js';
import { Settings } from './settings.js';
import { authorization, at, control } from './station.js';
import { IDENTITY } from './quaternion.js';
import { VideoFeed } from './video.js';
import { spanning } from './viewport.js';
import { WhepClient } from './whep.js';
import { Zoom } from './zoom.js';
import { actionsOf, bindButtons, keysOf, makeHeadButtons } from './controls.js';
import { Camera } from './camera.js';

/** @typedef {import('./quaternion.js').Quaternion} Quaternion */
/** @typedef {import('./viewport.js').Viewport} Viewport */

const LINK_LOST_MS = 3000; // silent for so long: start over
const TICK_MS = 250;
const SOFTWARE_PIXELS = 960 * 540;
const GPU_PIXELS = 3840 * 2160;

const byId = (/** @type {string} */ id) => /** @type {any} */ (document.getElementById(id));

export class App {
  /** @param {import('./station.js').Station} station @param {string} shaderBody */
  constructor(station, shaderBody) {
    this.station = station;
    this.notify = instruments.notify;
    this.wake = this.wake.bind(this);
    this.settings = new Settings();
    this.zoom = new Zoom(station.hfov_deg);
    this.stage = /** @type {HTMLElement} */ (byId('stage'));
    this.renderer = new Renderer(byId('view'), shaderBody, new Camera(station.camera));
    document.documentElement.classList.toggle('software', this.renderer.software);
    byId('pip').style.aspectRatio = station.camera.size.join(' / ');
    this.link = new Link(this.wake, (rtp) => this.latency.frameTold(rtp));
    this.latency = new Latency(this.link);
    this.makeHeads();
    this.makeVideo();
    this.makeInputs();
    this.counts = { drawn: 0, draws: 0 };
    /** @type {import('./video.js').FrameTimes | null} of a picture not drawn yet */
    this.undrawn = null;
    this.pictureMs = /** @type {number | null} */ (null);
    this.drawnKey = '';
    this.scheduled = 0;
    this.received = 0;
    new ResizeObserver(this.wake).observe(this.stage);
    this.whep.start();
    this.ticker = setInterval(() => this.tick(performance.now()), TICK_MS);
    this.tick(performance.now());
  }

  makeHeads() {
    const { hold_s: holdS, ease_s: easeS, trackers } = this.station;
    const patience = () => ({ holdS, easeS });
    this.hand = new HandHead();
    this.phone = new PhoneHead(this.settings, patience, this.wake);
    const heads = { hand: this.hand, phone: this.phone, trackers };
    this.command = new Command(heads, this.link, patience, control, (text) => {
      this.notify(text);
      this.wake();
    });
  }

  makeVideo() {
    this.video = /** @type {HTMLVideoElement} */ (byId('video'));
    const asked = new URLSearchParams(location.search).get('upload');
    const path = asked === 'planes' || asked === 'rgb' ? asked : this.renderer.software ? 'planes' : 'rgb';
    this.feed = new VideoFeed(this.video, this.renderer.picture, path, (times) => this.pictured(times));
    this.whepState = /** @type {import('./whep.js').WhepState} */ ('connecting');
    this.whepMessage = '';
    this.whep = new WhepClient(at('whep'), authorization, {
      onStream: (stream) => this.play(stream),
      onChannel: (channel) => this.link.attach(channel),
      onState: (state, message) => this.whepChanged(state, message),
    });
    addEventListener('pagehide', () => this.whep.close());
    addEventListener('pageshow', () => this.whep.start());
  }

  makeInputs() {
    const { command, zoom, settings, wake } = this;
    const actions = actionsOf(this);
    const viewport = () => this.viewOn(this.panes().main);
    this.pointer = new PointerInput(this.stage, { command, zoom, settings, viewport, wake });
    this.keyboard = new Keyboard({ command, zoom, settings, wake, actions: keysOf(actions) });
    this.gamepads = new Gamepads({ command, zoom, settings, wake });
    bindButtons(actions, wake);
    makeHeadButtons(this);
    fillPanel(byId('settings-form'), settings);
  }

  /** @param {MediaStream} stream */
  play(stream) {
    this.video.srcObject = stream;
    this.video.play().catch((error) => {
      if (error.name === 'NotAllowedError') this.notify('Tap to start the video');
      addEventListener('pointerdown', () => this.video.play().catch(() => {}), { once: true });
    });
  }

  /** @param {import('./whep.js').WhepState} state @param {string} message */
  whepChanged(state, message) {
    // A failed attempt stays on the screen while the next one is made.
    const trying = state === 'connecting' && this.whepState === 'lost';
    if (!trying) [this.whepState, this.whepMessage] = [state, message];
    if (state === 'connected') this.connectedMs = performance.now();
    this.tick(performance.now());
  }

  /** A new picture lies in the textures. @param {import('./video.js').FrameTimes} times */
  pictured(times) {
    this.undrawn = times;
    this.pictureMs = performance.now();
    this.feed.path === 'planes' ? this.drawNow() : this.wake();
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
    const aim = this.command.aim(nowMs);
    this.draw(aim, nowMs);
    if (this.keyboard.active || this.gamepads.active || aim.state === 'easing') this.wake();
  }

  /** @param {import('./hand.js').Aim} aim @param {number} nowMs */
  draw(aim, nowMs) {
    this.fitCanvas();
    this.renderer.grey = this.stale(nowMs) ? 1 : 0;
    const { pip, split, instruments: lines } = this.settings.values;
    const key = [aim.q, this.zoom.fieldDeg, this.renderer.picture.version, this.renderer.grey, pip,
      split, lines, this.stage.clientWidth, this.stage.clientHeight].join();
    if (key === this.drawnKey) return;
    this.drawnKey = key;
    this.drawPanes(aim.q);
    this.counts.draws += 1;
    const drawnMs = performance.now();
    this.latency.poseDrawn(drawnMs, aim.stampMs);
    if (this.undrawn) {
      this.counts.drawn += 1;
      this.latency.frameDrawn(drawnMs, this.undrawn);
      this.undrawn = null;
    }
  }

  /** @param {Quaternion} q */
  drawPanes(q) {
    const { renderer, ratio } = this;
    const { main, forward, fisheye } = this.panes();
    const view = this.viewOn(main);
    renderer.clear();
    renderer.drawView(scaled(main, ratio), q, view.hfovDeg);
    if (forward) renderer.drawView(scaled(forward, ratio), IDENTITY, this.viewOn(forward).hfovDeg);
    const lines = this.settings.get('instruments');
    const { pen } = renderer;
    pen.begin(ratio);
    if (lines) drawHorizon(pen, main, view, q);
    if (lines) drawTape(pen, tapePlace(main, ['top', 'readings'].map((id) => rectOf(byId(id)))), q);
    if (forward) drawCaption(pen, forward, 'STRAIGHT AHEAD');
    pen.end();
    if (fisheye) this.drawFisheye(fisheye, view, q);
    instruments.showField(view.hfovDeg);
  }

  /** @param {import('./renderer.js').Rect} rect @param {Viewport} view @param {Quaternion} q */
  drawFisheye(rect, view, q) {
    const { renderer, ratio } = this;
    const { x, y, width, height } = renderer.drawFisheye(scaled(rect, ratio));
    const place = { x: x / ratio, y: y / ratio, width: width / ratio, height: height / ratio };
    renderer.pen.begin(ratio);
    drawOutline(renderer.pen, place, renderer.camera, view, q);
    renderer.pen.end();
  }

  panes() {
    const { clientWidth, clientHeight } = this.stage;
    const { pip, split } = this.settings.values;
    byId('pip').hidden = !pip || split === 1;
    return panes(clientWidth, clientHeight, split, pip ? rectOf(byId('pip')) : null);
  }


  /** @param {{width: number, height: number}} pane @returns {Viewport} */
  viewOn({ width, height }) {
    return spanning(width, height, this.zoom.fieldDeg);
  }

  /** Canvas pixels per CSS pixel; fewer where software draws. */
  fitCanvas() {
    const { clientWidth: width, clientHeight: height } = this.stage;
    const asked = Number(new URLSearchParams(location.search).get('pixels'));
    const most = asked || (this.renderer.software ? SOFTWARE_PIXELS : GPU_PIXELS);
    this.ratio = Math.min(devicePixelRatio, 2, Math.sqrt(most / Math.max(1, width * height)));
    fit(this.renderer.canvas, width, height, this.ratio);
  }

  /** @param {number} nowMs */
  stale(nowMs) {
    return this.pictureMs !== null && nowMs - this.pictureMs > STALE_S * 1000;
  }

  /** What changes without a new frame or pose: ages, messages, dials. @param {number} nowMs */
  async tick(nowMs) {
    this.watchLink(nowMs);
    this.wake();
    const { status } = this.link;
    const head = this.command.source;
    const aim = this.command.aim(nowMs);
    instruments.showConditions(conditions({
      whep: this.whepState, whepMessage: this.whepMessage, linked: this.link.alive(nowMs),
      videoAgeS: this.pictureMs === null ? null : (nowMs - this.pictureMs) / 1000,
      status, head, aim, fits: this.fits(),
    }));
    instruments.showHead(head, aim.state, this.command.before);
    const { head: headDial, video, videoSince } = this.latency.summary(nowMs);
    instruments.showDial('head', headDial, 'since pose');
    instruments.showDial('video', video, videoSince);
    this.showSource(nowMs);
    this.received = await this.framesReceived();
    instruments.showCounts(this.frameCounts(), status?.viewers ?? 0);
  }

  /** @param {number} nowMs */
  watchLink(nowMs) {
    if (this.whepState !== 'connected' || this.link.alive(nowMs)) return;
    const since = Math.max(this.link.lastMs ?? 0, this.connectedMs ?? nowMs);
    if (nowMs - since > LINK_LOST_MS) this.whep.lost('it fell silent');
  }

  fits() {
    const { version, width, height } = this.renderer.picture;
    return !version || this.renderer.profile.sameShape(width, height);
  }

  /** @param {number} nowMs */
  showSource(nowMs) {
    const source = this.link.status?.source;
    const heard = this.link.alive(nowMs);
    const size = source?.size ? source.size.join('×') : '';
    const detail = [source?.codec?.toUpperCase(), size].filter(Boolean).join(' · ');
    const state = heard ? source?.state ?? 'connecting' : 'lost';
    instruments.showSource(this.station.demo ? 'Demo' : this.station.source, state, detail);
  }

  frameCounts() {
    const { drawn } = this.counts;
    const received = Math.max(this.received, this.feed.presented);
    const pending = this.undrawn ? 1 : 0;
    return { received, drawn, dropped: Math.max(0, this.feed.presented - drawn - pending) };
  }

  /** As the browser's WebRTC counts them. */
  async framesReceived() {
    const report = await this.whep.peer?.getStats().catch(() => null);
    const inbound = [...(report?.values() ?? [])].find((entry) => entry.type === 'inbound-rtp');
    return inbound?.framesReceived ?? 0;
  }
}

/** @param {HTMLCanvasElement} canvas @param {number} width @param {number} height
 * @param {number} ratio */
function fit(canvas, width, height, ratio) {
  const size = [width, height].map((length) => Math.max(1, Math.round(length * ratio)));
  if (canvas.width !== size[0]) canvas.width = size[0];
  if (canvas.height !== size[1]) canvas.height = size[1];
}

/** @param {HTMLElement} element */
function rectOf(element) {
  const { x, y, width, height } = element.getBoundingClientRect();
  return { x, y, width, height };
}
