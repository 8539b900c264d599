// Numbers as people write them: with a decimal point or a decimal comma.

/**
 * A number; `null` of an empty field, NaN of anything else.
 * @param {string} text
 * @returns {number | null}
 */
export function number(text) {
  const own = text.trim().replace(",", ".");
  if (own === "") return null;
  return /^[+-]?(\d+\.?\d*|\.\d+)(e[+-]?\d+)?$/i.test(own) ? Number(own) : NaN;
}

/**
 * Numbers one after the other, each with a decimal point: "345,1; 344,9" and "345.1, 344.9" are two. A comma separates where
 * points are decimal, where a space follows, or where there are several in one word; otherwise it is decimal.
 * @param {string} text
 * @returns {string[]}
 */
export function list(text) {
  const words = text.split(/;|\s+|,(?=\s)/);
  const parts = words.flatMap((word) => {
    const many = word.includes(".") || word.split(",").length > 2;
    return many && !/[±=]/.test(word) ? word.split(",") : [word.replaceAll(",", ".")];
  });
  return parts.filter(Boolean);
}

/**
 * The same as numbers.
 * @param {string} text
 * @returns {number[]}
 */
export function numbers(text) {
  return list(text).map(Number);
}

/**
 * Two digits of an uncertain figure, without those that nobody measured.
 * @param {number | null} value
 */
export function two(value) {
  if (value === null || !Number.isFinite(value)) return "unknown";
  if (value === 0) return "0";
  const digits = Math.max(0, 1 - Math.floor(Math.log10(Math.abs(value))));
  return value.toFixed(Math.min(digits, 6));
}

/**
 * @param {number | null} value
 */
export function millimetres(value) {
  return `${two(value)} mm`;
}

/**
 * A probability in words.
 * @param {number} value
 */
export function chance(value) {
  if (value > 0.99) return "more than 99 %";
  if (value < 0.01) return "less than 1 %";
  return `${Math.round(100 * value)} %`;
}
