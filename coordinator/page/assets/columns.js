// Variables in the messages of a subsystem: the metadata of the channel map fields to variables.

/** Gives `[name, value]` of every variable in a message. `about` is the JSON of the metadata, `fields` those of the decoder. */
export function columnReader(about, fields, subsystem) {
  const seen = new Map();
  const places = about.map(({ name, field }) => {
    const key = field.join(".");
    const element = seen.get(key) ?? 0;
    seen.set(key, element + 1);
    const path = [];
    let level = fields;
    for (const number of field) { const f = level?.get(number); path.push(f?.name); level = f?.of; }
    return { name: `${subsystem}.${name}`, path, element };
  });
  const value = (message, { path, element }) => {
    let at = message;
    for (const name of path) at = at?.[name];
    return Number(Array.isArray(at) ? at[element] : at ?? NaN);
  };
  return (message, wanted) => places.filter((p) => wanted.has(p.name)).map((p) => [p.name, value(message, p)]);
}
