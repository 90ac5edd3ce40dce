// The client library of Foxglove and Lichtblick against a run that is served: the first steps of a viewer, printed as
// JSON. node foxglove_client.cjs ADDRESS, with @foxglove/ws-protocol and ws next to it.
const { FoxgloveClient } = require("@foxglove/ws-protocol");
const WebSocket = require("ws");

const client = new FoxgloveClient({ ws: new WebSocket(process.argv[2], [FoxgloveClient.SUPPORTED_SUBPROTOCOL]) });
const [topics, received, answers, statuses] = [new Map(), new Set(), new Map(), []];
let services = [];

// Polls until there is something.
const until = (wanted) => new Promise((done, fail) => {
  const end = Date.now() + 60_000;
  const look = () => {
    const found = wanted();
    if (found) done(found);
    else if (Date.now() > end) fail(new Error(`it did not come: ${wanted}`));
    else setTimeout(look, 20);
  };
  look();
});

const call = (name, callId) => {
  const serviceId = services.find((s) => s.name === name).id;
  client.sendServiceCallRequest({ serviceId, callId, encoding: "json", data: new DataView(new TextEncoder().encode("{}").buffer) });
  return until(() => answers.get(callId));
};
const write = (name, value, id) => {
  client.setParameters([{ name, value }], id);
  return until(() => answers.get(id));
};

client.on("error", (error) => { throw error; });
client.on("status", (status) => statuses.push(status.message));
client.on("advertise", (channels) => { for (const c of channels) topics.set(client.subscribe(c.id), c.topic); });
client.on("message", ({ subscriptionId }) => received.add(topics.get(subscriptionId)));
client.on("advertiseServices", (all) => { services = all; });
client.on("parameterValues", ({ parameters, id }) => answers.set(id, parameters));
client.on("serviceCallResponse", (response) => answers.set(response.callId, true));
client.on("open", async () => {
  await until(() => services.length && topics.size);
  client.getParameters([], "all");
  const all = await until(() => answers.get("all"));
  const taken = await write("robot.RF_j2.max_torque", 0, "taken");
  const refused = await write("robot.RF_j2.max_torque", -1, "refused");
  const acted = await call("robot.LF_j2.block", 1);
  await call("run.play", 2);
  const silent = () => [...topics.values()].filter((topic) => !received.has(topic));
  await until(() => !silent().length).catch(() => {});
  console.log(JSON.stringify({ parameters: all.map((p) => p.name), taken, refused, statuses, acted, silent: silent() }));
  process.exit(0);
});
