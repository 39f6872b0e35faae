// Small statistics over the last moments. Times are milliseconds of performance.now().

/** @param {number[]} values @param {number} percent @returns {number | null} nearest rank */
export function percentile(values, percent) {
  if (!values.length) return null;
  const sorted = [...values].sort((a, b) => a - b);
  return sorted[Math.max(0, Math.ceil((percent / 100) * sorted.length) - 1)];
}

/** Values of the last `spanMs`; at most `limit` of them. */
export class RecentValues {
  constructor(spanMs = 2000, limit = 1000) {
    this.spanMs = spanMs;
    this.limit = limit;
    /** @type {{at: number, value: number}[]} */
    this.entries = [];
  }

  /** @param {number} nowMs @param {number} value */
  add(nowMs, value) {
    this.entries.push({ at: nowMs, value });
    this.forget(nowMs);
  }

  /** @param {number} nowMs */
  forget(nowMs) {
    const kept = this.entries.findIndex((entry) => entry.at >= nowMs - this.spanMs);
    this.entries = kept < 0 ? [] : this.entries.slice(Math.max(kept, this.entries.length - this.limit));
  }

  /** @param {number} nowMs @returns {{median: number | null, p95: number | null, count: number}} */
  summary(nowMs) {
    this.forget(nowMs);
    const values = this.entries.map((entry) => entry.value);
    return { median: percentile(values, 50), p95: percentile(values, 95), count: values.length };
  }
}

/** Station clock against page clock, from the ping of the last `keep` that came back fastest:
 * its error is at most half its round trip. */
export class ClockOffset {
  constructor(keep = 30) {
    this.keep = keep;
    /** @type {{roundTripMs: number, offsetMs: number}[]} */
    this.pings = [];
  }

  /** @param {number} sentMs @param {number} receivedMs @param {number} stationNs */
  add(sentMs, receivedMs, stationNs) {
    const roundTripMs = receivedMs - sentMs;
    if (!(roundTripMs >= 0) || !Number.isFinite(stationNs)) return;
    this.pings.push({ roundTripMs, offsetMs: stationNs / 1e6 - (sentMs + roundTripMs / 2) });
    if (this.pings.length > this.keep) this.pings.shift();
  }

  get best() {
    return this.pings.reduce(
      (best, ping) => (best && best.roundTripMs <= ping.roundTripMs ? best : ping),
      /** @type {{roundTripMs: number, offsetMs: number} | null} */ (null),
    );
  }

  /** Page time of a station time, or null before the first ping came back.
   * @param {number | null | undefined} stationNs @returns {number | null} */
  pageMs(stationNs) {
    const best = this.best;
    return best && stationNs != null ? stationNs / 1e6 - best.offsetMs : null;
  }
}
