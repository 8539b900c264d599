// Unpacks the program: LZMA halves what static hosts send, with or without compression of their own. The format is that of
// `.lzma` files; names are those of its specification by I. Pavlov, https://7-zip.org/sdk.html.

const HEADER = 13;
/** Distances from this slot on end with bits of equal probability. */
const END_POSITION_SLOT = 14;

/** @param {number} length */
const evens = (length) => new Uint16Array(length).fill(1024);

/**
 * @param {Uint8Array} bytes
 * @returns {Uint8Array<ArrayBuffer>}
 */
export function unpacked(bytes) {
  const view = new DataView(bytes.buffer, bytes.byteOffset);
  const properties = bytes[0] ?? 0;
  const lc = properties % 9;
  const lp = Math.floor(properties / 9) % 5;
  const [lower, places] = [(1 << lp) - 1, (1 << Math.floor(properties / 45)) - 1];
  const out = new Uint8Array(view.getUint32(5, true));
  // The first byte of the range coder is zero.
  let [at, range, code] = [HEADER + 5, 0xffffffff, view.getUint32(HEADER + 1)];

  const next = () => {
    if (range < 0x1000000) {
      range = (range << 8) >>> 0;
      code = ((code << 8) | /** @type {number} */ (bytes[at++])) >>> 0;
    }
  };
  /** @param {Uint16Array} of @param {number} index */
  const bit = (of, index) => {
    const even = /** @type {number} */ (of[index]);
    const bound = Math.imul(range >>> 11, even) >>> 0;
    if (code < bound) {
      range = bound;
      of[index] = even + ((2048 - even) >> 5);
      next();
      return 0;
    }
    range = (range - bound) >>> 0;
    code = (code - bound) >>> 0;
    of[index] = even - (even >> 5);
    next();
    return 1;
  };
  /** @param {Uint16Array} of @param {number} from @param {number} bits */
  const tree = (of, from, bits) => {
    let found = 1;
    for (let index = 0; index < bits; index++) found = (found << 1) | bit(of, from + found);
    return found - (1 << bits);
  };
  /** @param {Uint16Array} of @param {number} from @param {number} bits */
  const reversed = (of, from, bits) => {
    let [node, found] = [1, 0];
    for (let index = 0; index < bits; index++) {
      const own = bit(of, from + node);
      node = (node << 1) | own;
      found |= own << index;
    }
    return found;
  };
  /** @param {number} bits */
  const direct = (bits) => {
    let found = 0;
    for (let index = 0; index < bits; index++) {
      range >>>= 1;
      const own = code >= range ? 1 : 0;
      if (own) code = (code - range) >>> 0;
      found = (found << 1) | own;
      next();
    }
    return found;
  };
  // Two choices, then lengths of 3 and 3 bits for each place, then of 8 bits.
  /** @param {Uint16Array} of @param {number} place */
  const length = (of, place) => {
    if (!bit(of, 0)) return 2 + tree(of, 2 + 8 * place, 3);
    return bit(of, 1) ? 18 + tree(of, 258, 8) : 10 + tree(of, 130 + 8 * place, 3);
  };

  const [isMatch, isRep, isRepG0, isRepG1, isRepG2, isRep0Long] = [evens(192), evens(12), evens(12), evens(12), evens(12), evens(192)];
  const [slots, special, align, lengths, repLengths, literals] = [evens(256), evens(115), evens(16), evens(514), evens(514), evens(768 << (lc + lp))];
  let [state, rep0, rep1, rep2, rep3, n] = [0, 0, 0, 0, 0, 0];
  while (n < out.length) {
    const place = n & places;
    if (!bit(isMatch, 16 * state + place)) {
      const from = 768 * (((n & lower) << lc) + ((out[n - 1] ?? 0) >> (8 - lc)));
      let symbol = 1;
      for (let like = state < 7 ? -1 : /** @type {number} */ (out[n - rep0 - 1]); like >= 0 && symbol < 256; like <<= 1) {
        const expected = (like >> 7) & 1;
        const own = bit(literals, from + ((1 + expected) << 8) + symbol);
        symbol = (symbol << 1) | own;
        if (own !== expected) break;
      }
      while (symbol < 256) symbol = (symbol << 1) | bit(literals, from + symbol);
      out[n++] = symbol;
      state = state < 4 ? 0 : state < 10 ? state - 3 : state - 6;
      continue;
    }
    let count = 1;
    if (!bit(isRep, state)) {
      [rep3, rep2, rep1] = [rep2, rep1, rep0];
      count = length(lengths, place);
      const slot = tree(slots, 64 * Math.min(count - 2, 3), 6);
      const bits = (slot >> 1) - 1;
      rep0 = slot < 4 ? slot : (2 | (slot & 1)) << bits;
      if (slot >= END_POSITION_SLOT) rep0 += 16 * direct(bits - 4) + reversed(align, 0, 4);
      else if (slot >= 4) rep0 += reversed(special, rep0 - slot, bits);
      state = state < 7 ? 7 : 10;
    } else if (bit(isRepG0, state)) {
      const far = bit(isRepG1, state) ? 2 + bit(isRepG2, state) : 1;
      const distance = far === 1 ? rep1 : far === 2 ? rep2 : rep3;
      if (far === 3) rep3 = rep2;
      if (far >= 2) rep2 = rep1;
      [rep1, rep0] = [rep0, distance];
      count = length(repLengths, place);
      state = state < 7 ? 8 : 11;
    } else if (bit(isRep0Long, 16 * state + place)) {
      count = length(repLengths, place);
      state = state < 7 ? 8 : 11;
    } else {
      state = state < 7 ? 9 : 11;
    }
    for (; count > 0; count--, n++) out[n] = /** @type {number} */ (out[n - rep0 - 1]);
  }
  return out;
}
