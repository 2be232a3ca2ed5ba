// Animated WebP from still ones (https://developers.google.com/speed/webp/docs/riff_container).

/** Time that the last picture stays, ms. */
const LAST = 2000;

/** Flag of an animation in the header. */
const ANIMATED = 0x02;

/** Flag of a picture that replaces the one before instead of being blended with it. */
const REPLACES = 0x02;

/** Returns a chunk: its name, its length, its data, padded to an even length. */
function chunk(name, ...parts) {
  const data = Buffer.concat(parts);
  const head = Buffer.alloc(8);
  head.write(name, "latin1");
  head.writeUInt32LE(data.length, 4);
  return Buffer.concat([head, data, Buffer.alloc(data.length % 2)]);
}

/** Returns numbers of three bytes each, little-endian. */
function triples(...numbers) {
  const bytes = Buffer.alloc(3 * numbers.length);
  numbers.forEach((number, index) => bytes.writeUIntLE(number, 3 * index, 3));
  return bytes;
}

/** Returns the chunk with the pixels of a still WebP. */
function pixels(webp) {
  for (let at = 12; at + 8 <= webp.length; ) {
    const name = webp.toString("latin1", at, at + 4);
    const length = webp.readUInt32LE(at + 4);
    const end = at + 8 + length + (length % 2);
    if (name === "VP8 " || name === "VP8L") return webp.subarray(at, end);
    at = end;
  }
  throw new Error("no pixels in this WebP");
}

/** Returns an animation that loops; each picture is `{ time, webp }`, the time in ms. */
export function animation({ width, height }, pictures) {
  const size = triples(width - 1, height - 1);
  const frames = pictures.map(({ time, webp }, index) => {
    const duration = Math.round((pictures[index + 1]?.time ?? time + LAST) - time);
    const head = [triples(0, 0), size, triples(duration), Buffer.from([REPLACES])];
    return chunk("ANMF", ...head, pixels(webp));
  });
  const header = chunk("VP8X", Buffer.from([ANIMATED, 0, 0, 0]), size);
  // White behind the pictures; 0 loops for ever.
  const loop = chunk("ANIM", Buffer.from([255, 255, 255, 255, 0, 0]));
  return chunk("RIFF", Buffer.from("WEBP"), header, loop, ...frames);
}
