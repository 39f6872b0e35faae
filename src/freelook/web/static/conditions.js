// What the pilot must be told now, most urgent first. Pure: everything comes in as values.

/** @typedef {{level: 'alert' | 'warn' | 'info', text: string}} Condition */
/**
 * @typedef {object} Situation
 * @property {string} whep state of the WHEP client @property {string} whepMessage
 * @property {boolean} linked whether the data channel is heard
 * @property {number | null} videoAgeS since the newest picture; null: none yet
 * @property {import('./link.js').Status | null} status
 * @property {string} head who is in command @property {import('./hand.js').Aim} aim
 * @property {boolean} fits whether the video has the lens profile's shape
 */

export const STALE_S = 1;

/** @param {Situation} now @returns {Condition[]} */
export function conditions(now) {
  return [...stationConditions(now), ...videoConditions(now), ...headConditions(now),
    ...notices(now)];
}

/** @param {Situation} now @returns {Condition[]} */
function stationConditions({ whep, whepMessage, linked }) {
  if (whep === 'lost') return [alert(`Station lost: ${whepMessage}. Trying again`)];
  if (whep === 'connected' && !linked) return [alert('The station is silent')];
  if (whep === 'connecting') return [info('Connecting to the station')];
  return [];
}

/** @param {Situation} now @returns {Condition[]} */
function videoConditions({ videoAgeS, status }) {
  const source = status?.source;
  const why = source && source.state !== 'live' ? `: ${source.message || source.state}` : '';
  if (videoAgeS === null) return [info(`Waiting for video${why}`)];
  if (videoAgeS >= STALE_S) return [alert(`Video lost ${Math.floor(videoAgeS)} s ago${why}`)];
  return [];
}

/** @param {Situation} now @returns {Condition[]} */
function headConditions({ head, aim, status }) {
  const name = { hand: 'Head', phone: 'Phone sensor' }[head] ?? head;
  const tracker = status?.trackers.find((one) => one.name === head);
  const ageMs = aim.ageMs ?? tracker?.age_ms ?? null;
  const silent = ageMs === null ? 'silent' : `silent for ${Math.max(0, Math.round(ageMs / 1000))} s`;
  switch (aim.state) {
    case 'waiting': return [info(`Waiting for ${name.toLowerCase() === 'head' ? 'a head' : name}`)];
    case 'holding': return [warn(`${name} ${silent}: holding`)];
    case 'easing': return [warn(`${name} ${silent}: easing to centre`)];
    case 'centred': return [warn(`${name} ${silent}: looking straight ahead`)];
    case 'front': return [warn('Eyes front: looking straight ahead; Space or T goes on')];
    case 'disabled': return [warn(`${name} is switched off: looking straight ahead`)];
    default: return [];
  }
}

/** @param {Situation} now @returns {Condition[]} */
function notices({ status, fits }) {
  const list = [];
  const trouble = status?.source.state === 'live' && status.source.message;
  if (trouble) list.push(warn(trouble));
  else if (!fits) list.push(warn('The video has another shape than the lens profile: the view is not true'));
  if (status?.vehicle?.message) list.push(warn(`Mode ${status.vehicle.mode}: ${status.vehicle.message}`));
  if (status?.source.transcoding) list.push(info(`Transcoding: ${status.source.transcoding}`));
  return list;
}

/** @param {string} text @returns {Condition} */
const alert = (text) => ({ level: 'alert', text });
/** @param {string} text @returns {Condition} */
const warn = (text) => ({ level: 'warn', text });
/** @param {string} text @returns {Condition} */
const info = (text) => ({ level: 'info', text });
