// window.freelook: for tests and for the curious.
//
//   ready                      true once the page has its shader and the station's camera
//   setHead(yaw, pitch, roll)  degrees; takes the command. setHead() gives it back
//   setView({width, height, hfovDeg, projection?})  the view that readView and readCoordinates draw;
//                              without argument: the window's own
//   readView()                 {width, height, rgba: base64, rows from the top}: the newest
//                              picture with the newest pose, drawn into memory
//   readCoordinates()          {width, height, values: base64 of float32 x, y, t, alpha per pixel}
//   putPicture({width, height, planes, matrix, fullRange})  instead of video: base64 planes
//                              (three: Y, U, V; two: Y, UV); counts as a received frame
//   stats()                    {received, drawn, dropped, draws, upload, renderer, whep, head,
//                              headState, angles, fieldDeg, grey, badMessages, size}
//   latencies()                {head, video: {median, p95, count} in ms, videoSince, clock}
//   headSource                 'hand', 'phone' or the tracker's name
//   app                        everything else

import { toAngles } from './quaternion.js';

/** @param {import('./app.js').App} app */
export function makeHooks(app) {
  /** @type {import('./viewport.js').Viewport | null} */
  let chosen = null;
  const view = () => chosen ?? wholePixels(app.screen.viewOn(app.screen.panes().main));
  const q = () => app.aim(performance.now()).q;
  return {
    ready: true,
    app,
    get headSource() {
      return app.command.source;
    },
    setHead: (/** @type {number[]} */ ...angles) => setHead(app, angles),
    setView: (/** @type {import('./viewport.js').Viewport | undefined} */ wanted) => {
      chosen = wanted ?? null;
    },
    readView: () => {
      const { width, height } = view();
      return { width, height, rgba: base64(app.renderer.readView(view(), q())) };
    },
    readCoordinates: () => {
      const { width, height } = view();
      const values = app.renderer.readCoordinates(view(), q());
      return { width, height, values: base64(new Uint8Array(values.buffer)) };
    },
    putPicture: (/** @type {any} */ picture) => putPicture(app, picture),
    stats: () => stats(app),
    latencies: () => ({
      ...app.latency.summary(performance.now()),
      clock: app.link.clock.best,
    }),
  };
}

/** @param {import('./app.js').App} app @param {number[]} angles */
function setHead(app, [yaw, pitch = 0, roll = 0]) {
  if (yaw === undefined) {
    app.command.giveBack();
  } else {
    app.command.takeByHand(performance.now());
    app.hand.set({ yaw, pitch, roll }, performance.now());
  }
  app.wake();
}

/** @param {import('./app.js').App} app
 * @param {{width: number, height: number, planes: string[], matrix?: 'bt601' | 'bt709',
 *   fullRange?: boolean}} picture */
function putPicture(app, { width, height, planes, matrix = 'bt709', fullRange = false }) {
  const made = planes.map((text, i) => {
    const channels = /** @type {1 | 2} */ (i === 1 && planes.length === 2 ? 2 : 1);
    const [w, h] = i ? [Math.ceil(width / 2), Math.ceil(height / 2)] : [width, height];
    const bytes = Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0));
    return { width: w, height: h, channels, stride: w * channels, bytes };
  });
  app.feed.presented += 1;
  app.renderer.picture.uploadPlanes(made, { matrix, fullRange });
  app.pictured({ receivedMs: performance.now(), rtp: null });
}

/** @param {import('./app.js').App} app */
function stats(app) {
  const aim = app.aim(performance.now());
  const { width, height } = app.renderer.picture;
  return {
    ...app.frameCounts(),
    draws: app.counts.draws,
    upload: app.feed.path,
    renderer: app.renderer.name,
    whep: app.whepState,
    head: app.command.source,
    headState: aim.state,
    angles: toAngles(aim.q),
    fieldDeg: app.zoom.fieldDeg,
    mode: app.link.status?.vehicle?.mode ?? 'body',
    grey: app.renderer.grey,
    badMessages: app.link.bad,
    size: [width, height],
  };
}

/** @param {import('./viewport.js').Viewport} view */
const wholePixels = ({ width, height, ...rest }) =>
  ({ width: Math.round(width), height: Math.round(height), ...rest });

/** @param {Uint8Array} bytes */
function base64(bytes) {
  let text = '';
  for (let i = 0; i < bytes.length; i += 0x8000) {
    text += String.fromCharCode(...bytes.subarray(i, i + 0x8000));
  }
  return btoa(text);
}
