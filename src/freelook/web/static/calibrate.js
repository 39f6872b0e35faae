// The calibration page: shows the newest look, sends what is asked for, ends with the view.

import { drawChart } from './calibrate_chart.js';
import { drawCamera, drawMap } from './calibrate_draw.js';
import { Feed, act, getJson } from './calibrate_feed.js';
import { RectifiedView } from './calibrate_view.js';
import { showConditions, showSource } from './instruments.js';

/** @typedef {import('./calibrate_feed.js').Look} Look */
/** @typedef {import('./calibrate_feed.js').News} News */

const TAKEN_MS = 1200; // so long "Taken" stays
const byId = (/** @type {string} */ id) => /** @type {any} */ (document.getElementById(id));
const body = document.body;
const KEYS = /** @type {Record<string, string>} */ (
  { t: 'take', d: 'drop', f: 'finish', m: 'mirror', v: 'compare' });

/** @param {number | null | undefined} px */
const pixels = (px) => (px === null || px === undefined ? '–' : `${px.toFixed(px < 1 ? 3 : 2)} px`);

/** @param {HTMLElement} element @param {string} text writes only what changed */
function write(element, text) {
  if (element.textContent !== text) element.textContent = text;
}

export class Page {
  constructor() {
    this.view = new RectifiedView(byId('view'));
    /** @type {News | null} */
    this.news = null;
    /** @type {ImageBitmap | null} */
    this.picture = null;
    /** @type {any} */
    this.result = null;
    this.views = 0;
    this.takenMs = -Infinity;
    /** why there is no rectified view */
    this.problem = '';
    /** the history that the chart shows */
    this.charted = '';
    this.feed = new Feed((news, picture) => this.hear(news, picture), (why) => this.lost(why));
    for (const button of byId('buttons').querySelectorAll('button')) {
      button.addEventListener('click', () => this.act(button.dataset.action));
    }
    addEventListener('keydown', (event) => this.press(event));
    new ResizeObserver(() => this.resized()).observe(byId('scene'));
    getJson('api/calibration').then(({ source }) => write(byId('source-name'), source)).catch(() => {});
    this.feed.run();
  }

  /** @param {News} news @param {ImageBitmap | null} picture */
  hear(news, picture) {
    this.news = news;
    if (picture) {
      this.picture?.close();
      this.picture = picture;
    }
    if (news.views > this.views) this.takenMs = performance.now();
    this.views = news.views;
    body.dataset.phase = news.phase;
    this.showSource(news);
    this.showWords(news);
    this.showFigures(news);
    if (news.phase === 'done' && this.result?.number !== news.result) this.fetchResult(news.result);
    byId('view').hidden = news.phase !== 'done' || body.classList.contains('comparing');
    if (picture && news.phase === 'done') this.view.show(picture);
    this.draw();
  }

  /** @param {string} why */
  lost(why) {
    body.dataset.lost = 'true';
    byId('source').dataset.state = 'lost';
    showConditions([{ level: 'alert', text: `No connection: ${why}. Trying again` }]);
  }

  /** @param {News} news */
  showSource({ source }) {
    const { state, message, size, age_ms: age, counters } = source;
    const lost = state === 'lost' || state === 'failed' || state === 'ended';
    const list = [];
    if (state === 'connecting') list.push({ level: 'info', text: `Waiting for video: ${message}` });
    if (state === 'ended') list.push({ level: 'warn', text: 'The recording is over' });
    if (this.problem) list.push({ level: 'alert', text: this.problem });
    if (lost && state !== 'ended') {
      const old = age ? `; the picture is ${(age / 1000).toFixed(0)} s old` : '';
      list.push({ level: 'alert', text: `Video lost: ${message}${old}` });
    } else if (state === 'live' && message) list.push({ level: 'warn', text: message });
    showConditions(/** @type {any} */ (list));
    body.dataset.lost = String(lost);
    const dropped = (counters.dropped_frames ?? 0) + (counters.skipped ?? 0);
    const detail = size ? `${size[0]}×${size[1]}, ${counters.looks ?? 0} searched, ${dropped} dropped` : '';
    showSource(byId('source-name').textContent, state, detail);
  }

  /** @param {News} news */
  showWords({ look, phase, message, solving }) {
    const taken = performance.now() - this.takenMs < TAKEN_MS;
    const verdict = byId('verdict');
    verdict.dataset.verdict = taken ? 'taken' : look?.verdict ?? 'absent';
    const sentence = look ? look.sentence : 'Waiting for the camera';
    write(verdict, taken ? `Taken: ${this.views}` : this.sided(sentence));
    const hold = byId('hold');
    hold.classList.toggle('enough', look?.enough ?? false);
    write(hold, phase === 'finishing' ? `Solving: ${solving}` : this.sided(next(look)));
    const trouble = message || (look?.trouble ? `Not solved yet: ${look.trouble}` : '');
    byId('message').hidden = !trouble;
    write(byId('message'), trouble);
    write(byId('solving'), solving && phase === 'taking' ? 'solving' : '');
  }

  /** What is right in the picture is left in its mirror image. @param {string} text */
  sided(text) {
    if (!body.classList.contains('mirrored')) return text;
    return text.replace(/\b(left|right)\b/g, (side) => (side === 'left' ? 'right' : 'left'));
  }

  /** @param {News} news */
  showFigures({ look, views }) {
    write(byId('views'), String(views));
    write(byId('views-word'), views === 1 ? 'view' : 'views');
    byId('buttons').querySelector('[data-action=drop]').disabled = views === 0;
    byId('buttons').querySelector('[data-action=finish]').disabled = views === 0;
    if (!look) return;
    body.style.setProperty('--aspect', String(look.size[0] / look.size[1]));
    const seen = look.filled.filter((filled) => filled).length;
    write(byId('coverage-text'), `seen: ${seen} of ${look.filled.length} parts of the picture`);
    const newest = look.history[look.history.length - 1];
    write(byId('rms'), pixels(newest?.rms_px));
    write(byId('left-out'), pixels(newest?.left_out_px));
    write(byId('sure'), pixels(newest?.uncertainty_px));
    const key = JSON.stringify(look.history);
    if (key !== this.charted) drawChart(byId('chart'), look.history);
    this.charted = key;
  }

  draw() {
    const { news, picture } = this;
    if (!news?.look) return;
    drawCamera(byId('camera'), picture, news.look, news.phase === 'taking');
    if (news.phase !== 'done') drawMap(byId('map'), news.look);
  }

  resized() {
    this.draw();
    this.view.draw();
  }

  /** @param {number | null} number */
  async fetchResult(number) {
    this.result = { number };
    this.problem = '';
    try {
      this.result = await getJson('api/calibration/result');
      await this.view.use(this.result.camera);
    } catch (error) {
      this.problem = `No rectified view: ${error instanceof Error ? error.message : error}`;
      if (!this.result.where) this.result = null; // ask again with the next look
    }
    this.showResult();
    if (this.picture) this.view.show(this.picture);
  }

  showResult() {
    byId('result').hidden = !this.result;
    if (!this.result) return;
    const where = byId('where');
    where.classList.toggle('failed', !this.result.saved);
    write(where, capital(this.result.where));
    byId('sentences').replaceChildren(...this.result.sentences.map((/** @type {string} */ text) => {
      const line = document.createElement('li');
      line.textContent = text;
      return line;
    }));
    byId('buttons').querySelector('[data-action=download]').disabled = !this.result.profile;
    byId('view').focus({ preventScroll: true });
  }

  /** @param {string} action */
  async act(action) {
    if (action === 'mirror') return this.toggle('mirrored', action);
    if (action === 'compare') return this.toggle('comparing', action);
    if (action === 'download') return this.download();
    if (action === 'restart' && this.views > 0 && !confirm('Forget all views?')) return undefined;
    if (action === 'restart' || action === 'resume') this.leaveResult();
    const why = await act(action);
    if (why) showConditions([{ level: 'alert', text: `Not done: ${why}` }]);
    return undefined;
  }

  leaveResult() {
    byId('result').hidden = true;
    body.classList.remove('comparing');
    [this.result, this.problem] = [null, ''];
  }

  /** @param {string} name @param {string} action */
  toggle(name, action) {
    const on = body.classList.toggle(name);
    byId('buttons').querySelector(`[data-action=${action}]`).setAttribute('aria-pressed', String(on));
    if (this.news) this.hear(this.news, null);
  }

  download() {
    const url = URL.createObjectURL(new Blob([this.result.profile], { type: 'application/json' }));
    const link = Object.assign(document.createElement('a'), { href: url, download: 'lens.json' });
    link.click();
    setTimeout(() => URL.revokeObjectURL(url), 10000);
  }

  /** @param {KeyboardEvent} event */
  press(event) {
    if (event.ctrlKey || event.metaKey || event.altKey || event.repeat) return;
    const action = KEYS[event.key.toLowerCase()];
    const button = action && byId('buttons').querySelector(`[data-action=${action}]`);
    if (!button || button.disabled || !button.offsetParent) return;
    event.preventDefault();
    this.act(action);
  }
}

/** Where to hold the board, in words. @param {Look | undefined} look */
function next(look) {
  if (!look) return 'Hold a board in front of the camera';
  if (look.hold) return look.hold.sentence;
  return look.enough ? 'That is enough: finish, or take more to be more certain'
    : 'Take some more views, wherever you like';
}

/** @param {string} text */
const capital = (text) => text.charAt(0).toUpperCase() + text.slice(1);

Object.assign(window, { calibration: new Page() });
