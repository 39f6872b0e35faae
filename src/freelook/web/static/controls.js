// Buttons and keys to actions.

import { SPLITS } from './layout.js';
import { PROJECTIONS } from './projections.js';

/** @typedef {import('./app.js').App} App */

const byId = (/** @type {string} */ id) => /** @type {HTMLElement} */ (document.getElementById(id));

/** @param {string} id @param {boolean} [open] */
export function togglePanel(id, open) {
  for (const panel of document.querySelectorAll('.panel')) {
    const shown = panel.id === id && (open ?? /** @type {HTMLElement} */ (panel).hidden);
    /** @type {HTMLElement} */ (panel).hidden = !shown;
  }
}

/** @param {App} app @returns {Record<string, () => void>} by name */
export function actionsOf(app) {
  const { command, zoom, settings } = app;
  return {
    recentre: () => command.recentre(),
    enable: () => command.toggle(),
    front: () => command.toggleFront(),
    mode: () => app.nextMode(),
    narrower: () => zoom.by(1 / 1.15),
    wider: () => zoom.by(1.15),
    projection: () => nextProjection(app),
    pip: () => settings.set('pip', !settings.get('pip')),
    split: () => settings.set('split', (settings.get('split') + 1) % SPLITS.length),
    full: toggleFullScreen,
    instruments: () => settings.set('instruments', !settings.get('instruments')),
    theme: () => nextTheme(app),
    panels: () => {
      settings.set('panels', !settings.get('panels'));
      togglePanel('', false);
    },
    settings: () => togglePanel('settings'),
    help: () => togglePanel('help'),
    close: () => togglePanel('', false),
    'give-back': () => command.giveBack(),
  };
}

/** @param {App} app */
function nextProjection(app) {
  const names = Object.keys(PROJECTIONS);
  const next = names[(names.indexOf(app.screen.projection) + 1) % names.length];
  app.settings.set('projection', next);
  /** @type {HTMLSelectElement} */ (byId('projection-select')).value = next;
  app.notify(`Projection: ${next}`);
}

/** @param {App} app */
function nextTheme(app) {
  const names = Object.keys(app.hud.themes);
  const next = names[(names.indexOf(app.settings.get('hud')) + 1) % names.length];
  app.settings.set('hud', next);
  /** @type {HTMLSelectElement} */ (byId('hud-select')).value = next;
  app.notify(`Lines: ${next}`);
}

/** @param {Record<string, () => void>} actions @returns {Record<string, () => void>} by key code */
export const keysOf = (actions) => ({
  KeyR: actions.recentre, KeyC: actions.recentre, KeyT: actions.enable, KeyF: actions.full,
  KeyP: actions.pip, KeyV: actions.split, KeyH: actions.help, KeyI: actions.instruments,
  KeyU: actions.theme, KeyB: actions.panels,
  KeyG: actions['give-back'], KeyM: actions.mode, KeyO: actions.projection, Space: actions.front, Escape: actions.close,
});

/** Every element with data-action does that. @param {Record<string, () => void>} actions
 * @param {() => void} wake */
export function bindButtons(actions, wake) {
  for (const button of document.querySelectorAll('[data-action]')) {
    button.addEventListener('click', () => {
      actions[/** @type {HTMLElement} */ (button).dataset.action ?? '']();
      /** @type {HTMLElement} */ (button).blur(); // so that keys go on steering
      wake();
    });
  }
}

/** One button for each head. @param {App} app */
export function makeHeadButtons(app) {
  const phone = matchMedia('(pointer: coarse)').matches ? ['phone'] : [];
  byId('heads').replaceChildren(...['hand', ...phone, ...app.command.trackers].map((name) => {
    const button = document.createElement('button');
    button.type = 'button';
    button.value = name;
    button.textContent = { hand: 'You', phone: 'Phone' }[name] ?? name;
    button.addEventListener('click', () => {
      chooseHead(app, name);
      button.blur();
    });
    return button;
  }));
}

/** @param {App} app @param {string} name */
export async function chooseHead(app, name) {
  const why = name === 'phone' ? await app.phone.start() : null;
  if (why) app.notify(why);
  else app.command.give(name);
  app.wake();
}

async function toggleFullScreen() {
  if (document.fullscreenElement) await document.exitFullscreen();
  else await document.documentElement.requestFullscreen?.({ navigationUI: 'hide' }).catch(() => {});
}
