// What changes without a new frame or pose: ages, messages, dials, counts. Four times a second.

import { conditions } from './conditions.js';
import * as instruments from './instruments.js';

/** @param {import('./app.js').App} app @param {number} nowMs */
export function report(app, nowMs) {
  const { link, command, station } = app;
  const head = command.source;
  const aim = command.aim(nowMs);
  const linked = link.alive(nowMs);
  instruments.showConditions(conditions({
    whep: app.whepState,
    whepMessage: app.whepMessage,
    linked,
    videoAgeS: app.pictureMs === null ? null : (nowMs - app.pictureMs) / 1000,
    status: link.status,
    head,
    aim,
    fits: fits(app.renderer),
  }));
  instruments.showMode(link.status?.vehicle);
  instruments.showHead(head, aim.state, command.before);
  const { head: headDial, video, videoSince } = app.latency.summary(nowMs);
  instruments.showDial('head', headDial, 'since pose');
  instruments.showDial('video', video, videoSince);
  const source = link.status?.source;
  const detail = [source?.codec?.toUpperCase(), source?.size?.join('×')].filter(Boolean).join(' · ');
  const state = linked ? source?.state ?? 'connecting' : 'lost';
  instruments.showSource(station.demo ? 'Demo' : station.source, state, detail);
  instruments.showCounts(app.frameCounts(), link.status?.viewers ?? 0);
}

/** Whether the picture has the lens profile's shape. @param {import('./renderer.js').Renderer} renderer */
function fits({ picture: { version, width, height }, profile }) {
  return !version || profile.sameShape(width, height);
}

/** As the browser's WebRTC counts them. @param {RTCPeerConnection | null} peer
 * @returns {Promise<number>} */
export async function framesReceived(peer) {
  const entries = await peer?.getStats().catch(() => null);
  let count = 0;
  entries?.forEach((entry) => {
    if (entry.type === 'inbound-rtp') count = entry.framesReceived ?? 0;
  });
  return count;
}
