// Arrays of the page: bytes of numbers in base 64.

const TYPES = { f8: Float64Array, f4: Float32Array, i2: Int16Array, i4: Int32Array, u1: Uint8Array };

/** The numbers of a block; rounded ones come back as they were meant. */
export function decode(block) {
  const text = atob(block.data);
  const bytes = new Uint8Array(text.length);
  for (let i = 0; i < text.length; i++) bytes[i] = text.charCodeAt(i);
  const numbers = new TYPES[block.kind](bytes.buffer);
  return block.kind === "i2" ? Float32Array.from(numbers, (x) => x * block.scale) : numbers;
}

/** Frames of a motion: times, displacements of nodes and contact points, pressures, with friction tractions; the contact points that have curves. */
export function framesOf(raw) {
  const frames = { shown: raw.shown };
  for (const name of ["t", "u", "contact", "pressure", "active"]) frames[name] = decode(raw[name]);
  for (const name of ["traction", "bears"]) if (raw[name]) frames[name] = decode(raw[name]);
  return frames;
}

/** The frame before a time, and how far the time is towards the next. */
export function place(t, at) {
  let low = 0;
  let high = t.length - 1;
  if (high < 1 || at <= t[0]) return [0, 0];
  if (at >= t[high]) return [high - 1, 1];
  while (high - low > 1) {
    const middle = (low + high) >> 1;
    if (t[middle] <= at) low = middle;
    else high = middle;
  }
  return [low, (at - t[low]) / (t[high] - t[low])];
}
