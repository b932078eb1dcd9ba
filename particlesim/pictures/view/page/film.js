// Frames from the server: fetched ahead, kept while there is room for them.

const ROOM = 400e6; // bytes of frames kept
const AT_ONCE = 3; // requests under way

const KINDS = { float32: Float32Array, uint8: Uint8Array, int8: Int8Array };

// Ask the server; what it refuses is an Error with its words.
export async function ask(path, options) {
  let answer;
  try {
    answer = await fetch(path, options);
  } catch (error) {
    if (error.name === "AbortError") throw error;
    throw new Error("the server does not answer; is particlesim view still running?");
  }
  if (!answer.ok) {
    const said = await answer.json().catch(() => ({}));
    throw new Error(said.error || `${path}: ${answer.status}`);
  }
  return answer;
}

// A packet: count, JSON, arrays; see packet.py.
export function unpack(buffer) {
  const size = 4 + new DataView(buffer).getUint32(0, true);
  const header = JSON.parse(new TextDecoder().decode(new Uint8Array(buffer, 4, size - 4)));
  for (const each of Object.values(header.arrays)) {
    each.values = new KINDS[each.type](buffer, size + each.offset, each.count * each.width);
  }
  return { ...header, box: around(Object.entries(header.arrays)), bytes: buffer.byteLength };
}

// Lower and upper corner of all arrays but planes, which have no end of their own; null of nothing.
function around(arrays) {
  const lower = [Infinity, Infinity, Infinity];
  const upper = [-Infinity, -Infinity, -Infinity];
  for (const [name, { values, width, radius = 0 }] of arrays) {
    if (!/^(thing|boundary)\.(ball|cone|wire|corner|veil)$/.test(name)) continue;
    for (let row = 0; row < values.length; row += width) {
      const r = width === 4 ? values[row + 3] : radius;
      for (let k = 0; k < 3; k++) {
        if (values[row + k] - r < lower[k]) lower[k] = values[row + k] - r;
        if (values[row + k] + r > upper[k]) upper[k] = values[row + k] + r;
      }
    }
  }
  return [...lower, ...upper].every(Number.isFinite) ? [lower, upper] : null;
}

export class Film {
  // codes: time codes by index. arrived(index) and failed(index, error) are called when that is so.
  constructor(arrived, failed) {
    this.arrived = arrived;
    this.failed = failed;
    this.codes = [];
    this.query = "";
    this.clear();
  }

  // Forget all; what is under way is not wanted any more.
  clear() {
    for (const aborter of this.pending?.values() ?? []) aborter.abort();
    this.pending = new Map();
    this.kept = new Map();
    this.refused = new Map();
    this.bytes = 0;
  }

  get(index) {
    return this.kept.get(index);
  }

  // Fetch these, the first ones first; whatever else is under way is not wanted any more.
  want(indices) {
    for (const [index, aborter] of this.pending) {
      if (!indices.includes(index)) {
        aborter.abort();
        this.pending.delete(index);
      }
    }
    for (const index of indices) {
      if (this.pending.size >= AT_ONCE) break;
      const known = this.kept.has(index) || this.pending.has(index) || this.refused.has(index);
      if (!known && index < this.codes.length) this.fetch(index);
    }
  }

  async fetch(index) {
    const aborter = new AbortController();
    this.pending.set(index, aborter);
    try {
      const path = `frame/${this.codes[index]}?${this.query}`;
      const answer = await ask(path, { signal: aborter.signal });
      const packet = unpack(await answer.arrayBuffer());
      if (this.pending.get(index) !== aborter) return;
      this.pending.delete(index);
      this.keep(index, packet);
      this.arrived(index);
    } catch (error) {
      if (this.pending.get(index) !== aborter) return;
      this.pending.delete(index);
      this.refused.set(index, error);
      this.failed(index, error);
    }
  }

  keep(index, packet) {
    this.kept.set(index, packet);
    this.bytes += packet.bytes;
    // The oldest go first, which in a film that runs are those farthest behind.
    for (const [old, each] of this.kept) {
      if (this.bytes <= ROOM || old === index) break;
      this.kept.delete(old);
      this.bytes -= each.bytes;
    }
  }
}
