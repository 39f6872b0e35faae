// Pulls the station's newest look, for ever: the next one is asked for when this one is shown, so
// a slow page or a slow network gets fewer of them, and never old ones.

import { authorization, at } from './station.js';

/** @typedef {[number, number]} Point pixels of the full picture */
/**
 * @typedef {object} Look
 * @property {Point} size @property {string} verdict @property {string} sentence
 * @property {Point[]} corners @property {number} held @property {number} views
 * @property {Point[][]} outlines @property {(Point | null)[][]} sectors @property {boolean[]} filled
 * @property {{sentence: string, outline: (Point | null)[], sector: number | null} | null} hold
 * @property {{views: number, rms_px: number, left_out_px: number | null, uncertainty_px: number | null}[]} history
 * @property {string} trouble @property {boolean} enough
 */
/**
 * @typedef {object} News
 * @property {number} number
 * @property {{state: string, message: string, age_ms: number | null, codec: string | null,
 *   size: Point | null, counters: Record<string, number>}} source
 * @property {'taking' | 'finishing' | 'done'} phase @property {string} message
 * @property {string} solving @property {number} views @property {number | null} result
 * @property {Look} [look]
 */

const RETRY_MS = 1000;
const PATIENCE_MS = 8000;

export class Feed {
  /** @param {(news: News, picture: ImageBitmap | null) => void} onNews
   * @param {(why: string) => void} onLost */
  constructor(onNews, onLost) {
    this.onNews = onNews;
    this.onLost = onLost;
    this.after = 0;
    this.pictures = 0;
  }

  async run() {
    for (;;) {
      try {
        await this.pull();
      } catch (error) {
        this.onLost(error instanceof Refused ? error.message : 'the station does not answer');
        await new Promise((resolve) => setTimeout(resolve, RETRY_MS));
      }
    }
  }

  async pull() {
    const response = await fetch(at(`api/calibration/newest?after=${this.after}`), {
      headers: authorization, cache: 'no-store', signal: AbortSignal.timeout(PATIENCE_MS),
    });
    if (!response.ok) throw new Refused((await response.text()).trim() || `error ${response.status}`);
    const { news, jpeg } = taken(await response.arrayBuffer());
    this.after = news.number;
    const picture = jpeg && await createImageBitmap(jpeg).catch(() => null);
    if (picture) this.pictures += 1;
    this.onNews(news, picture);
  }
}

/** The station answered, and said no. */
class Refused extends Error {}

/** @param {ArrayBuffer} buffer @returns {{news: News, jpeg: Blob | null}} */
function taken(buffer) {
  const length = new DataView(buffer).getUint32(0);
  const text = new TextDecoder().decode(new Uint8Array(buffer, 4, length));
  const rest = buffer.byteLength - 4 - length;
  const jpeg = rest > 0 ? new Blob([new Uint8Array(buffer, 4 + length)], { type: 'image/jpeg' }) : null;
  return { news: JSON.parse(text), jpeg };
}

/** @param {string} action @returns {Promise<string | null>} null when done, else why not */
export async function act(action) {
  try {
    const response = await fetch(at('api/calibration/action'), {
      method: 'POST',
      headers: { ...authorization, 'Content-Type': 'application/json' },
      body: JSON.stringify({ action }),
    });
    return response.ok ? null : (await response.text()).trim() || `error ${response.status}`;
  } catch {
    return 'the station does not answer';
  }
}

/** @param {string} path @returns {Promise<any>} */
export async function getJson(path) {
  const response = await fetch(at(path), { headers: authorization, cache: 'no-store' });
  if (!response.ok) throw new Refused((await response.text()).trim() || `error ${response.status}`);
  return response.json();
}
