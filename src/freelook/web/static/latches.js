// What the pilot switched and must find again when the page was loaded anew: kept in
// sessionStorage, which belongs to this tab alone.

const KEY = 'freelook.latches';

/** @typedef {{front: boolean, hand: boolean, phone: boolean}} LatchValues front: eyes front;
 * hand, phone: switched on */

/** @returns {LatchValues} */
export function storedLatches() {
  const usual = { front: false, hand: true, phone: true };
  try {
    const stored = JSON.parse(sessionStorage.getItem(KEY) ?? '{}');
    const bool = (/** @type {keyof LatchValues} */ name) =>
      (typeof stored?.[name] === 'boolean' ? stored[name] : usual[name]);
    return { front: bool('front'), hand: bool('hand'), phone: bool('phone') };
  } catch {
    return usual;
  }
}

/** @param {LatchValues} values */
export function storeLatches(values) {
  try {
    sessionStorage.setItem(KEY, JSON.stringify(values));
  } catch {
    // forbidden: it holds until the page is closed
  }
}
