// Reads Protobuf messages by the descriptors that a channel announces: any type, no code per message.

const DOUBLE = 1, FLOAT = 2, INT64 = 3, UINT64 = 4, INT32 = 5, FIXED64 = 6, FIXED32 = 7, BOOL = 8, STRING = 9, MESSAGE = 11;
const BYTES = 12, UINT32 = 13, ENUM = 14, SFIXED32 = 15, SFIXED64 = 16, SINT32 = 17, SINT64 = 18;
const REPEATED = 3;
const NESTED = new Set([STRING, MESSAGE, BYTES]);

// A message of the descriptors themselves: number → [name, type, repeated, message].
const field = (name, type, repeated, of) => ({ name, type, repeated: repeated === true, of, optional: false });
const table = (entries) => new Map(Object.entries(entries).map(([number, f]) => [Number(number), f]));
const FIELD = table({ 1: field("name", STRING), 3: field("number", INT32), 4: field("label", ENUM), 5: field("type", ENUM),
  6: field("type_name", STRING), 17: field("proto3_optional", BOOL) });
const DESCRIPTOR = table({ 1: field("name", STRING), 2: field("field", MESSAGE, true, FIELD) });
DESCRIPTOR.set(3, field("nested_type", MESSAGE, true, DESCRIPTOR));
const FILE = table({ 2: field("package", STRING), 4: field("message_type", MESSAGE, true, DESCRIPTOR) });
const FILES = table({ 1: field("file", MESSAGE, true, FILE) });

const text = new TextDecoder();

// A reader of numbers in a piece of memory.
class Reader {
  constructor(bytes) {
    this.bytes = bytes;
    this.view = new DataView(bytes.buffer, bytes.byteOffset, bytes.byteLength);
    this.at = 0;
  }
  varint() {
    let [value, factor] = [0, 1];
    for (;;) {
      const byte = this.bytes[this.at++];
      if (byte === undefined) throw new RangeError("the message ends early");
      value += (byte & 0x7f) * factor;
      if (byte < 0x80) return value;
      factor *= 128;
    }
  }
  // Whole numbers of 64 bits whose first bit is a sign; a negative one has ten bytes, too many for the digits of a number.
  signed() {
    const from = this.at;
    const value = this.varint();
    if (value < 2 ** 53) return value;
    const bits = this.bytes.subarray(from, this.at).reduceRight((sum, byte) => (sum << 7n) | BigInt(byte & 0x7f), 0n);
    return Number(BigInt.asIntN(64, bits));
  }
  piece() {
    const size = this.varint();
    if (this.at + size > this.bytes.length) throw new RangeError("the message ends early");
    this.at += size;
    return this.bytes.subarray(this.at - size, this.at);
  }
  fixed(kind, size) {
    this.at += size;
    return Number(this.view[kind](this.at - size, true));
  }
  skip(wire) {
    if (wire === 0) this.varint();
    else if (wire === 1) this.at += 8;
    else if (wire === 2) this.piece();
    else if (wire === 5) this.at += 4;
    else throw new RangeError(`wire type ${wire}`);
  }
}

const zigzag = (n) => (n % 2 ? -(n + 1) / 2 : n / 2);
const SCALARS = {
  [DOUBLE]: (r) => r.fixed("getFloat64", 8), [FLOAT]: (r) => r.fixed("getFloat32", 4),
  [FIXED64]: (r) => r.fixed("getBigUint64", 8), [SFIXED64]: (r) => r.fixed("getBigInt64", 8),
  [FIXED32]: (r) => r.fixed("getUint32", 4), [SFIXED32]: (r) => r.fixed("getInt32", 4),
  [INT64]: (r) => r.signed(), [INT32]: (r) => r.signed(), [ENUM]: (r) => r.signed(),
  [UINT64]: (r) => r.varint(), [UINT32]: (r) => r.varint(), [BOOL]: (r) => r.varint() !== 0,
  [SINT32]: (r) => zigzag(r.varint()), [SINT64]: (r) => zigzag(r.varint()),
};

function one(reader, f) {
  if (f.type === STRING) return text.decode(reader.piece());
  if (f.type === BYTES) return reader.piece();
  if (f.type === MESSAGE) return read(reader.piece(), f.of);
  return SCALARS[f.type](reader);
}

function blank(fields) {
  const out = {};
  for (const f of fields.values()) {
    if (f.repeated) out[f.name] = [];
    else if (f.optional || f.type === MESSAGE) out[f.name] = null;
    else out[f.name] = f.type === STRING ? "" : f.type === BYTES ? new Uint8Array() : f.type === BOOL ? false : 0;
  }
  return out;
}

function read(bytes, fields) {
  const [reader, out] = [new Reader(bytes), blank(fields)];
  while (reader.at < bytes.length) {
    const key = reader.varint();
    const [f, wire] = [fields.get(Math.floor(key / 8)), key % 8];
    if (!f) { reader.skip(wire); continue; }
    if (!f.repeated) { out[f.name] = one(reader, f); continue; }
    if (wire !== 2 || NESTED.has(f.type)) { out[f.name].push(one(reader, f)); continue; }
    const packed = new Reader(reader.piece());
    while (packed.at < packed.bytes.length) out[f.name].push(SCALARS[f.type](packed));
  }
  return out;
}

// All messages of a file, by full name.
function collect(types, prefix, messages) {
  for (const message of messages) {
    const name = `${prefix}.${message.name}`;
    types.set(name, { fields: new Map(), declared: message.field });
    collect(types, name, message.nested_type);
  }
}

// A type by its name as a field gives it: absolute with a leading dot, else relative to the type that has the field.
function resolved(types, name, from) {
  if (name.startsWith(".")) return types.get(name);
  for (let scope = from; ; scope = scope.slice(0, scope.lastIndexOf("."))) {
    const found = types.get(`${scope}.${name}`);
    if (found || !scope) return found;
  }
}

/** A function that reads messages of the type `name` by a set of file descriptors; its `fields` are those of the type by number. */
export function decoder(descriptors, name) {
  const types = new Map();
  for (const file of read(descriptors, FILES).file) collect(types, file.package ? `.${file.package}` : "", file.message_type);
  for (const [from, { fields, declared }] of types) {
    for (const f of declared) {
      const of = f.type === MESSAGE ? resolved(types, f.type_name, from)?.fields : undefined;
      // bytes of a type that is not described are left as they are
      if (f.type === MESSAGE && !of) f.type = BYTES;
      fields.set(f.number, { ...field(f.name, f.type, f.label === REPEATED, of), optional: f.proto3_optional });
    }
  }
  const type = types.get(`.${name}`);
  if (!type) throw new Error(`no message type ${name}`);
  return Object.assign((bytes) => read(bytes, type.fields), { fields: type.fields });
}
