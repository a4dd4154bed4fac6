// Reads the arrays of a page that were packed by drivers/sheet/meshes.py.
"use strict";

// Inverse of Pack in drivers/sheet/meshes.py: columns of whole numbers from differences.
function unpack(bytes, {at, rows, columns, bits, low = 0, step = 1}) {
  const size = bits / 8, total = rows * columns, mask = bits === 32 ? 0xffffffff : (1 << bits) - 1;
  const values = low === 0 && step === 1 ? new Uint32Array(total) : new Float32Array(total);
  for (let k = 0; k < columns; ++k) {
    let sum = 0;
    for (let i = 0; i < rows; ++i) {
      let difference = 0;
      for (let b = size - 1; b >= 0; --b)
        difference = difference * 256 + bytes[at + b * total + k * rows + i];
      sum = ((sum + difference) & mask) >>> 0;
      values[i * columns + k] = low + step * sum;
    }
  }
  return values;
}

async function inflate(text) {
  const packed = Uint8Array.from(atob(text), letter => letter.charCodeAt(0));
  const stream = new Blob([packed]).stream().pipeThrough(new DecompressionStream("deflate"));
  return new Uint8Array(await new Response(stream).arrayBuffer());
}
