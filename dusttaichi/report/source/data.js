// Arrays as Python packs them (dusttaichi/report/packing.py): base64 of deflate of byte planes.

const TYPES = { u1: Uint8Array, u2: Uint16Array, u4: Uint32Array, f4: Float32Array };

async function inflate(text) {
  const bytes = Uint8Array.from(atob(text), (c) => c.charCodeAt(0));
  const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("deflate"));
  return new Uint8Array(await new Response(stream).arrayBuffer());
}

// packed: {type, shape, rows, low, high, data}. The numbers stand in `rows` rows, each of which but
// the first is the difference to the one before; low and high: what 0 and the largest number mean.
export async function unpack(packed) {
  const planes = await inflate(packed.data);
  const size = Number(packed.type[1]);
  const count = planes.length / size;
  const bytes = new Uint8Array(planes.length);
  for (let b = 0; b < size; b++) {
    for (let k = 0; k < count; k++) bytes[k * size + b] = planes[b * count + k];
  }
  const values = new TYPES[packed.type](bytes.buffer);
  if (packed.type[0] === "u") {
    const row = count / packed.rows;
    for (let k = row; k < count; k++) values[k] += values[k - row];
  }
  if (packed.low === undefined) return values;
  const scale = (packed.high - packed.low) / (2 ** (8 * size) - 1);
  return Float32Array.from(values, (v) => packed.low + v * scale);
}
