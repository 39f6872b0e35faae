// What the page asks the station for over HTTP. The token of the page's address goes along.

/**
 * @typedef {object} Station
 * @property {string} version @property {string} source @property {boolean} demo
 * @property {import('./camera.js').CameraJson} camera @property {string[]} trackers
 * @property {number} hold_s @property {number} ease_s @property {number} hfov_deg
 * @property {string} [projection] of the views at the start
 * @property {string} [hud] its theme at the start, or off
 * @property {string} limit soft or black: past the lens's edge @property {string[]} modes
 * @property {number} rate_deg_s of changes that are eased
 * @property {import('./zoom.js').ZoomLimits} zoom
 */

const token = new URLSearchParams(location.search).get('token');

/** @type {Record<string, string>} */
export const authorization = token ? { Authorization: `Bearer ${token}` } : {};

/** @param {string} path @returns {URL} */
export const at = (path) => new URL(path, document.baseURI);

/** @param {string} path @returns {Promise<Response>} an Error with the station's words otherwise */
async function get(path) {
  const response = await fetch(at(path), { headers: authorization, cache: 'no-store' });
  if (!response.ok) {
    const why = (await response.text()).trim();
    throw new Error(why || `the station answered ${response.status} to ${path}`);
  }
  return response;
}

/** @returns {Promise<Station>} */
export const getStation = async () => (await get('api/station')).json();

/** @returns {Promise<string>} */
export const getShader = async () => (await get('view.glsl')).text();

/** @typedef {{known: import('./hud_words.js').Definition, source: string}} Hud hud.json, and the
 * text of pen.glsl */

/** @returns {Promise<Hud>} */
export async function getHud() {
  const [known, source] = await Promise.all([get('hud.json'), get('pen.glsl')]);
  return { known: await known.json(), source: await source.text() };
}

/** @param {string} tracker @param {'recentre' | 'enable' | 'disable'} action
 * @returns {Promise<string | null>} null when done, else why not */
export const control = (tracker, action) => post('api/control', { tracker, action });

/** @param {string} mode @returns {Promise<string | null>} null when done, else why not */
export const setMode = (mode) => post('api/mode', { mode });

/** @param {string} path @param {object} what @returns {Promise<string | null>} */
async function post(path, what) {
  try {
    const response = await fetch(at(path), {
      method: 'POST',
      headers: { ...authorization, 'Content-Type': 'application/json' },
      body: JSON.stringify(what),
    });
    return response.ok ? null : (await response.text()).trim() || `error ${response.status}`;
  } catch {
    return 'the station does not answer';
  }
}
