// From Y, U, V (0 to 1) to R, G, B: ITU-R BT.601 and BT.709, full and limited range.

const WEIGHTS = { bt601: [0.299, 0.114], bt709: [0.2126, 0.0722] }; // of red, of blue

/** @typedef {{matrix: 'bt601' | 'bt709', fullRange: boolean}} ColorSpace */

/** rgb = matrix (yuv - offset). @param {ColorSpace} color
 * @returns {{matrix: number[], offset: number[]}} matrix as rows */
export function rgbFromYuv({ matrix, fullRange }) {
  const [red, blue] = WEIGHTS[matrix];
  const green = 1 - red - blue;
  const luma = fullRange ? 1 : 255 / 219;
  const chroma = 2 * (fullRange ? 1 : 255 / 224);
  return {
    matrix: [
      luma, 0, chroma * (1 - red),
      luma, (-chroma * blue * (1 - blue)) / green, (-chroma * red * (1 - red)) / green,
      luma, chroma * (1 - blue), 0,
    ],
    offset: [fullRange ? 0 : 16 / 255, 128 / 255, 128 / 255],
  };
}

/** What a decoded frame says about itself; where it does not say, players' usual assumption:
 * limited range, BT.709 from 720 lines up and BT.601 below.
 * @param {{matrix?: string | null, fullRange?: boolean | null}} stated @param {number} height
 * @returns {ColorSpace} */
export function colorSpace(stated, height) {
  const known = { bt709: 'bt709', smpte170m: 'bt601', bt470bg: 'bt601' }[stated.matrix ?? ''];
  const matrix = known ?? (height >= 720 ? 'bt709' : 'bt601');
  return /** @type {ColorSpace} */ ({ matrix, fullRange: stated.fullRange ?? false });
}
