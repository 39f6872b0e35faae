// What the pilot must be told now, most urgent first. Pure: everything comes in as values. The words
// and limits are those of hud.json, as in freelook/hud/conditions.py.

import { say, whole } from './hud_words.js';

/** @typedef {import('./hud_words.js').Definition} Definition */
/** @typedef {{level: 'alert' | 'warn' | 'info', text: string}} Condition */
/**
 * @typedef {object} Situation
 * @property {string} whep state of the WHEP client @property {string} whepMessage
 * @property {boolean} linked whether the data channel is heard
 * @property {number | null} videoAgeS since the newest picture; null: none yet
 * @property {number | null} [videoLateMs] how old pictures are when they are drawn
 * @property {import('./link.js').Status | null} status
 * @property {string} head who is in command @property {import('./hand.js').Aim} aim
 * @property {boolean} [limited] whether the lens's edge holds the view back
 * @property {boolean} fits whether the video has the lens profile's shape
 */

export const STALE_S = 1;

/** @param {Definition} known @param {Situation} now @returns {Condition[]} */
export function conditions(known, now) {
  return [stationConditions, videoConditions, headConditions, limits, recordings, notices]
    .flatMap((make) => make(known, now));
}

/** @param {Definition} known @param {Situation} now @returns {Condition[]} */
function stationConditions(known, { whep, whepMessage, linked }) {
  if (whep === 'lost') return [alert(say(known, 'station_lost', { why: whepMessage }))];
  if (whep === 'connected' && !linked) return [alert(say(known, 'station_silent'))];
  if (whep === 'connecting') return [info(say(known, 'connecting'))];
  return [];
}

/** @param {Definition} known @param {Situation} now @returns {Condition[]} */
function videoConditions(known, { videoAgeS, videoLateMs = null, status }) {
  const { lost_s: lostS, old_s: oldS } = known.warnings;
  const source = status?.source;
  const why = source && source.state !== 'live' ? `: ${source.message || source.state}` : '';
  if (videoAgeS === null) return [info(say(known, 'video_waiting', { why }))];
  if (videoAgeS >= lostS) {
    return [alert(say(known, 'video_lost', { s: Math.floor(videoAgeS), why }))];
  }
  const ms = whole(Math.max(1000 * videoAgeS, videoLateMs ?? 0));
  return ms >= 1000 * oldS ? [warn(say(known, 'video_old', { ms }))] : [];
}

/** @param {Definition} known @param {Situation} now @returns {Condition[]} */
function headConditions(known, { head, aim, status }) {
  const name = { hand: 'Head', phone: 'Phone sensor' }[head] ?? head;
  const tracker = status?.trackers.find((one) => one.name === head);
  const ageMs = aim.ageMs ?? tracker?.age_ms ?? null;
  const silent = ageMs === null ? say(known, 'silent')
    : say(known, 'silent_for', { s: Math.max(0, whole(ageMs / 1000)) });
  switch (aim.state) {
    case 'waiting':
      return [info(say(known, 'head_waiting', { name: name.toLowerCase() === 'head' ? 'a head' : name }))];
    case 'holding': case 'easing': case 'centred':
      return [warn(say(known, aim.state, { name, silent }))];
    case 'front': return [warn(say(known, 'front', { keys: 'Space or T' }))];
    case 'disabled': case 'failed': return [warn(say(known, aim.state, { name }))];
    default: return [];
  }
}

/** @param {Definition} known @param {Situation} now @returns {Condition[]} */
const limits = (known, { limited = false }) => (limited ? [warn(say(known, 'limit'))] : []);

/** @param {Definition} known @param {Situation} now @returns {Condition[]} */
const recordings = (known, { status }) => (status?.recordings ?? [])
  .filter(({ state }) => state === 'failed')
  .map(({ message }) => alert(say(known, 'recording_failed', { why: message ? `: ${message}` : '' })));

/** @param {Definition} known @param {Situation} now @returns {Condition[]} */
function notices(known, { status, fits }) {
  const list = [];
  const trouble = status?.source.state === 'live' && status.source.message;
  if (trouble) list.push(warn(trouble));
  else if (!fits) list.push(warn('The video has another shape than the lens profile: the view is not true'));
  const vehicle = status?.vehicle;
  if (vehicle?.message) list.push(warn(say(known, 'mode', { mode: vehicle.mode, why: vehicle.message })));
  if (status?.source.transcoding) list.push(info(`Transcoding: ${status.source.transcoding}`));
  return list;
}

/** @param {string} text @returns {Condition} */
const alert = (text) => ({ level: 'alert', text });
/** @param {string} text @returns {Condition} */
const warn = (text) => ({ level: 'warn', text });
/** @param {string} text @returns {Condition} */
const info = (text) => ({ level: 'info', text });
