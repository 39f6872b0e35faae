// The readings beside the picture: two dials, counts, who is in command, what is wrong.

import { level } from './hud.js';

const NOTICE_MS = 2500;

/** @typedef {{median: number | null, p95: number | null, count: number}} Summary */

const byId = (/** @type {string} */ id) => /** @type {HTMLElement} */ (document.getElementById(id));

/** @param {HTMLElement} element @param {string} text writes only what changed */
function write(element, text) {
  if (element.textContent !== text) element.textContent = text;
}

/** @param {import('./hud_words.js').Definition} known @param {'head' | 'video'} name
 * @param {Summary} summary @param {string} caption */
export function showDial(known, name, { median, p95 }, caption) {
  const dial = byId(`dial-${name}`);
  const share = (/** @type {number | null} */ ms) =>
    Math.min(1, (ms ?? 0) / known.dials.full_ms[name]);
  dial.style.setProperty('--median', String(share(median)));
  dial.style.setProperty('--p95', String(share(p95)));
  dial.dataset.level = level(known, name, { median, p95 });
  write(part(dial, '.value'), median === null ? '–' : median.toFixed(median < 10 ? 1 : 0));
  write(part(dial, '.p95'), p95 === null ? 'p95 –' : `p95 ${p95.toFixed(p95 < 10 ? 1 : 0)} ms`);
  write(part(dial, '.caption'), caption);
}

/** @param {HTMLElement} parent @param {string} selector */
const part = (parent, selector) => /** @type {HTMLElement} */ (parent.querySelector(selector));

/** @param {{received: number, drawn: number, dropped: number}} counts @param {number} viewers */
export function showCounts({ received, drawn, dropped }, viewers) {
  write(byId('count-received'), String(received));
  write(byId('count-drawn'), String(drawn));
  write(byId('count-dropped'), String(dropped));
  write(byId('count-viewers'), String(viewers));
}

/** @param {import('./conditions.js').Condition[]} list */
export function showConditions(list) {
  const box = byId('conditions');
  const key = JSON.stringify(list);
  if (box.dataset.key === key) return;
  box.dataset.key = key;
  box.replaceChildren(...list.map(({ level, text }) => {
    const line = document.createElement('p');
    line.className = level;
    line.textContent = text;
    return line;
  }));
}

/** @type {number | undefined} */
let noticeTimer;

/** A passing word. @param {string} text */
export function notify(text) {
  const notice = byId('notice');
  write(notice, text);
  notice.classList.add('shown');
  clearTimeout(noticeTimer);
  noticeTimer = window.setTimeout(() => notice.classList.remove('shown'), NOTICE_MS);
}

/** @param {string} name @param {string} state @param {string} detail */
export function showSource(name, state, detail) {
  byId('source').dataset.state = state;
  write(byId('source-name'), name);
  write(byId('source-detail'), detail);
}

/** @param {import('./link.js').Vehicle} [vehicle] */
export function showMode({ mode, state } = { mode: 'body', effective: 'body', state: '', message: '' }) {
  write(byId('mode'), mode);
  byId('mode').dataset.state = state;
  const select = /** @type {HTMLSelectElement | null} */ (document.getElementById('mode-select'));
  if (select && document.activeElement !== select) select.value = mode;
}

/** @param {string} head who is in command @param {string} state @param {string | null} before */
export function showHead(head, state, before) {
  for (const button of byId('heads').querySelectorAll('button')) {
    const chosen = button.value === head;
    button.setAttribute('aria-pressed', String(chosen));
    button.dataset.state = chosen ? state : '';
  }
  const back = byId('give-back');
  back.hidden = before === null;
  if (before) write(back, `Give back to ${before === 'phone' ? 'the phone' : before}`);
}

/** @param {number} hfovDeg */
export const showField = (hfovDeg) => write(byId('field'), `${Math.round(hfovDeg)}°`);

/** @param {string} text of the recording that is being made; nothing without one */
export function showRecording(text) {
  byId('recording').hidden = !text;
  write(byId('recording'), text);
}

/** The page cannot go on. @param {string} text */
export function showFatal(text) {
  write(byId('fatal-text'), text);
  byId('fatal').hidden = false;
}
