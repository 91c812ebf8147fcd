// 32-bit floating-point functions that the translated rules need and JavaScript lacks. See predprey_env/jit/floats.py.

const DOUBLE = new Float64Array(1), WORDS = new Uint32Array(DOUBLE.buffer);
const LOW = new Uint8Array(new Uint32Array([1]).buffer)[0] ? 0 : 1; // which word of a double holds its low bits
const SINGLE = new Float32Array(1), BITS = new Int32Array(SINGLE.buffer);

// Return a * b + c, rounded once. The sum is first rounded to a double by rounding to odd, which preserves on which side
// of a tie between two 32-bit floats the exact sum lies.
function fma(a, b, c) {
  const product = a * b; // exact
  const total = product + c;
  const rest = total - product;
  const error = (product - (total - rest)) + (c - rest);
  if (error === 0) return Math.fround(total);
  DOUBLE[0] = total;
  if (WORDS[LOW] & 1) return Math.fround(total);
  if (error > 0 === total > 0) {
    WORDS[LOW] += 1; // even, so it does not carry
  } else if (WORDS[LOW]-- === 0) {
    WORDS[1 - LOW] -= 1;
  }
  return Math.fround(DOUBLE[0]);
}

function power_of_two(shifted) {
  SINGLE[0] = shifted;
  BITS[0] <<= 23;
  return SINGLE[0];
}

function bits_of(a) {
  SINGLE[0] = a;
  return BITS[0];
}

function float_of(a) {
  BITS[0] = a;
  return SINGLE[0];
}

const as_float = Math.fround;
const as_integer = Math.trunc;
const zeros = (_, blank) => blank.map(() => 0);

function add_products(sums, weights, row, factor) {
  for (let k = 0; k < sums.length; k++) sums[k] = fma(weights[row + k], factor, sums[k]);
  return sums;
}
