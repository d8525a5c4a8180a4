// Reads arrays of an npz file: a zip of npy files, stored or deflated.

const inflate = (bytes) =>
  new Response(new Blob([bytes]).stream().pipeThrough(new DecompressionStream("deflate-raw"))).arrayBuffer();

// The places of the members, from the directory at the end of the file.
function directory(buffer) {
  const view = new DataView(buffer);
  const members = new Map();
  const text = new TextDecoder();
  let end = buffer.byteLength - 22;
  while (view.getUint32(end, true) !== 0x06054b50) end -= 1;
  let at = view.getUint32(end + 16, true);
  for (let count = view.getUint16(end + 10, true); count > 0; count--) {
    const lengths = [28, 30, 32].map((offset) => view.getUint16(at + offset, true));
    const name = text.decode(new Uint8Array(buffer, at + 46, lengths[0]));
    members.set(name, {
      method: view.getUint16(at + 10, true),
      size: view.getUint32(at + 20, true),
      header: view.getUint32(at + 42, true),
    });
    at += 46 + lengths[0] + lengths[1] + lengths[2];
  }
  return members;
}

async function member(buffer, { method, size, header }) {
  const view = new DataView(buffer);
  const start = header + 30 + view.getUint16(header + 26, true) + view.getUint16(header + 28, true);
  return method ? inflate(new Uint8Array(buffer, start, size)) : buffer.slice(start, start + size);
}

const TYPES = {
  "|b1": Uint8Array,
  "|u1": Uint8Array,
  "<u2": Uint16Array,
  "|i1": Int8Array,
  "<i2": Int16Array,
  "<i4": Int32Array,
  "<f8": Float64Array,
};

function npy(buffer) {
  const view = new DataView(buffer);
  const start = 10 + view.getUint16(8, true);
  const header = new TextDecoder().decode(new Uint8Array(buffer, 10, start - 10));
  const type = /'descr': '([^']+)'/.exec(header)[1];
  return new TYPES[type](buffer.slice(start));
}

// The arrays of these names that the file has, flat: typed arrays, and lists of texts, whose codes the file has.
export async function arrays(buffer, names) {
  const members = directory(buffer);
  const read = async (name) => npy(await member(buffer, members.get(`${name}.npy`)));
  const { texts } = JSON.parse(new TextDecoder().decode(await read("meta")));
  const storedNames = names.filter((name) => members.has(`${name}.npy`));
  const values = await Promise.all(storedNames.map(read));
  const shown = (name, codes) => (texts[name] ? Array.from(codes, (code) => texts[name][code]) : codes);
  return Object.fromEntries(storedNames.map((name, k) => [name, shown(name, values[k])]));
}
