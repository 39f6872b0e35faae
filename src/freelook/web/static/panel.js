// The settings panel: direction and scale of every input.

import { PROJECTIONS } from './projections.js';
import { INPUTS } from './settings.js';

/** @param {HTMLElement} form @param {import('./settings.js').Settings} settings
 * @param {string[]} modes @param {import('./hud_words.js').Definition} hud
 * @param {(mode: string) => void} setMode */
export function fillPanel(form, settings, modes, hud, setMode) {
  const rows = Object.entries(INPUTS).map(([input, { title, axes }]) =>
    fieldset(title, axes.flatMap((axis) => (input === 'phone'
      ? [axisRow(settings, input, axis), deadZoneRow(settings, input, axis)]
      : [axisRow(settings, input, axis)]))));
  rows[0].append(choice(settings, 'dragMoves', 'Dragging moves',
    [['picture', 'the picture'], ['head', 'the head']]));
  rows[2].append(choice(settings, 'stick', 'Right stick gives',
    [['rate', 'turning speed'], ['position', 'direction']]));
  const reset = element('button', { type: 'button', textContent: 'Reset all' });
  reset.addEventListener('click', () => {
    settings.reset();
    fillPanel(form, settings, modes, hud, setMode);
  });
  const projections = Object.keys(PROJECTIONS).map((name) => /** @type {[string, string]} */
    ([name, name]));
  const themes = Object.entries(hud.themes).map(([name, { about }]) => /** @type {[string, string]} */
    ([name, `${name}: ${about}`]));
  const view = fieldset('View', [modeRow(modes, setMode),
    choice(settings, 'projection', 'Projection', projections), choice(settings, 'limit',
    'Past the lens’s edge', [['black', 'black'], ['soft', 'stop softly before it']]), choice(settings, 'hud', 'Lines', themes)]);
  form.replaceChildren(...rows, view, reset);
}

/** Of everybody's view, at the station. @param {string[]} modes
 * @param {(mode: string) => void} setMode */
function modeRow(modes, setMode) {
  const select = element('select', { id: 'mode-select' });
  for (const mode of modes) select.append(element('option', { value: mode, textContent: mode }));
  select.addEventListener('change', () => setMode(select.value));
  const row = element('label', { className: 'row' });
  row.append(element('span', { textContent: 'Mode, for all viewers' }), select);
  return row;
}

/** @param {string} title @param {HTMLElement[]} rows */
function fieldset(title, rows) {
  const set = element('fieldset', {});
  set.append(element('legend', { textContent: title }), ...rows);
  return set;
}

/** @param {import('./settings.js').Settings} settings @param {string} input @param {string} axis */
function axisRow(settings, input, axis) {
  const [scaleKey, invertKey] = [`${input}.${axis}.scale`, `${input}.${axis}.invert`];
  const scale = element('input', {
    type: 'range', min: '0.25', max: '3', step: '0.05', value: String(settings.get(scaleKey) ?? 1),
    ariaLabel: `${axis} scale`,
  });
  const shown = element('output', { textContent: `${scale.value}×` });
  scale.addEventListener('input', () => {
    settings.set(scaleKey, Number(scale.value));
    shown.textContent = `${scale.value}×`;
  });
  const invert = element('input', { type: 'checkbox', checked: Boolean(settings.get(invertKey)) });
  invert.addEventListener('change', () => settings.set(invertKey, invert.checked));
  const inverted = element('label', {});
  inverted.append(invert, ' invert');
  const row = element('div', { className: 'row' });
  row.append(element('span', { textContent: axis }), scale, shown, inverted);
  return row;
}

/** @param {import('./settings.js').Settings} settings @param {string} input @param {string} axis */
function deadZoneRow(settings, input, axis) {
  const dead = element('input', {
    type: 'range', min: '0', max: '20', step: '0.5',
    value: String(settings.deadZone(input, axis)), ariaLabel: `${axis} dead zone`,
  });
  const shown = element('output', { textContent: `${dead.value}°` });
  dead.addEventListener('input', () => {
    settings.set(`${input}.${axis}.dead`, Number(dead.value));
    shown.textContent = `${dead.value}°`;
  });
  const row = element('div', { className: 'row' });
  row.append(element('span', { textContent: `${axis}: still within` }), dead, shown);
  return row;
}

/** @param {import('./settings.js').Settings} settings @param {string} key @param {string} title
 * @param {[string, string][]} options */
function choice(settings, key, title, options) {
  const select = element('select', { id: `${key}-select` });
  for (const [value, textContent] of options) select.append(element('option', { value, textContent }));
  select.value = settings.get(key);
  select.addEventListener('change', () => settings.set(key, select.value));
  const row = element('label', { className: 'row' });
  row.append(element('span', { textContent: title }), select);
  return row;
}

/** @template {keyof HTMLElementTagNameMap} K @param {K} tag @param {object} properties
 * @returns {HTMLElementTagNameMap[K]} */
function element(tag, properties) {
  return Object.assign(document.createElement(tag), properties);
}
