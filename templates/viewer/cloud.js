// Points that were computed when the page was made: whole numbers in a box, compressed (see kinegen/tools/viewer/document.py).

/** The points of a cloud, three numbers each. */
async function unpacked({ points, low, high, count }) {
  const bytes = Uint8Array.from(atob(points), (letter) => letter.charCodeAt(0));
  const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("deflate"));
  const packed = new DataView(await new Response(stream).arrayBuffer());
  const found = new Float32Array(3 * count);
  for (let axis = 0; axis < 3; axis++) {
    let level = 0;
    for (let place = 0; place < count; place++) {
      level = (level + packed.getUint16(2 * (axis * count + place), true)) % 65536;
      found[3 * place + axis] = low[axis] + ((high[axis] - low[axis]) * level) / 65535;
    }
  }
  return found;
}
