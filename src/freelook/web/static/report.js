// What changes without a new frame or pose: ages, messages, dials, counts. Four times a second.

import { conditions } from './conditions.js';
import { say } from './hud_words.js';
import * as instruments from './instruments.js';

/** @param {import('./app.js').App} app @param {number} nowMs */
export function report(app, nowMs) {
  const { link, command, station, hud } = app;
  const head = command.source;
  const aim = command.aim(nowMs);
  const linked = link.alive(nowMs);
  const latency = app.latency.summary(nowMs);
  const told = conditions(hud, {
    whep: app.whepState,
    whepMessage: app.whepMessage,
    linked,
    videoAgeS: app.pictureMs === null ? null : (nowMs - app.pictureMs) / 1000,
    videoLateMs: latency.video.median,
    status: link.status,
    head,
    aim,
    limited: app.limit.holding > hud.warnings.limit_deg,
    fits: fits(app.renderer),
  });
  instruments.showConditions(told);
  instruments.showMode(link.status?.vehicle);
  instruments.showHead(head, aim.state, command.before);
  instruments.showDial(hud, 'head', latency.head, 'since pose');
  instruments.showDial(hud, 'video', latency.video, latency.videoSince);
  const source = link.status?.source;
  const detail = [source?.codec?.toUpperCase(), source?.size?.join('×')].filter(Boolean).join(' · ');
  const state = linked ? source?.state ?? 'connecting' : 'lost';
  instruments.showSource(station.demo ? 'Demo' : station.source, state, detail);
  instruments.showCounts(app.frameCounts(), link.status?.viewers ?? 0);
  const recording = recordingOf(link.status);
  instruments.showRecording(recording?.state === 'live' ? say(hud, 'rec', { n: recording.shown }) : '');
  app.screen.told = {
    link: { state, lost: source?.counters?.lost ?? 0 },
    tracker: { name: { hand: 'You', phone: 'Phone' }[head] ?? head, state: aim.state },
    mode: link.status?.vehicle?.mode ?? 'body',
    recording,
    warnings: told,
    dials: { head: latency.head, video: latency.video },
  };
}

/** The recordings as one. @param {import('./link.js').Status | null} status */
function recordingOf(status) {
  const live = (status?.recordings ?? []).filter(({ state }) => state === 'live');
  return live.length ? { state: 'live', shown: Math.max(...live.map(({ shown }) => shown)) } : null;
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
