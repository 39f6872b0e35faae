// Starts the page: what the browser must have, what the station says, then the app.

import { App } from './app.js';
import { makeHooks } from './hooks.js';
import { showConditions, showFatal } from './instruments.js';
import { getHud, getShader, getStation } from './station.js';

const RETRY_MS = 2000;

/** @returns {string | null} what is missing for good */
function missing() {
  if (typeof RTCPeerConnection === 'undefined') {
    return 'This browser has no WebRTC, which carries the video. Try a current Chrome, Edge, '
      + 'Firefox or Safari, and look whether an extension switches it off.';
  }
  if (!document.createElement('canvas').getContext('webgl2')) {
    return 'This browser has no WebGL2, which draws the view. Try a current Chrome, Edge, Firefox '
      + 'or Safari, and look whether hardware acceleration is switched off.';
  }
  return null;
}

async function start() {
  const why = missing();
  if (why) return showFatal(why);
  try {
    const [station, shader, hud] = await Promise.all([getStation(), getShader(), getHud()]);
    const app = new App(station, shader, hud);
    Object.assign(window, { freelook: makeHooks(app) });
    app.renderer.canvas.addEventListener('webglcontextlost', () => location.reload());
  } catch (error) {
    const text = error instanceof Error ? error.message : String(error);
    showConditions([{ level: 'alert', text: `Cannot start: ${text}. Trying again` }]);
    setTimeout(start, RETRY_MS);
  }
}

start();
