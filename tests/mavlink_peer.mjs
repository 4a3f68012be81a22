// SPDX-License-Identifier: BSD-3-Clause
// Decodes MAVLink 2 frames with a package of others, to check RO-SLAM against.
//
//   npm install --prefix DIR node-mavlink          (DIR: an absolute path)
//   ROSLAM_NODE_PACKAGES=DIR node tests/mavlink_peer.mjs read FILE
//   ROSLAM_NODE_PACKAGES=DIR node tests/mavlink_peer.mjs thin FILE THINNED
//
// read: prints one JSON object: the messages in FILE (frames one after the other, as they were sent), each with all
// its fields under their names of the message definitions; the bytes that they take and the frames with a wrong
// checksum.
// thin: writes a part of the frames of FILE to THINNED: every eighth ODOMETRY, every fortieth TIMESYNC, those next to
// a text, and all other messages.
//
// How tests/data/mavlink_flight.bin and mavlink_flight.json were made, with node-mavlink 2.3.0:
//
//   ROSLAM_NODE_PACKAGES=DIR ROSLAM_MAVLINK_FLIGHT=flight.bin build/release/tests/mavlink_peer_test
//   ROSLAM_NODE_PACKAGES=DIR node tests/mavlink_peer.mjs thin flight.bin tests/data/mavlink_flight.bin
//   ROSLAM_NODE_PACKAGES=DIR node tests/mavlink_peer.mjs read tests/data/mavlink_flight.bin > tests/data/mavlink_flight.json
import { createRequire } from "node:module";
import { once } from "node:events";
import { readFile, writeFile } from "node:fs/promises";
import path from "node:path";

const folder = process.env.ROSLAM_NODE_PACKAGES ?? ".";
const load = createRequire(path.resolve(folder, "package.json"));
const { MavLinkPacketSplitter, MavLinkPacketParser, minimal, common } = load("node-mavlink");

const DEFINITIONS = { ...minimal.REGISTRY, ...common.REGISTRY };

// The shortest number that is rounded to a float of 32 bits.
function shortest(float) {
  for (let digits = 1; digits < 9; ++digits) {
    const number = Number(float.toPrecision(digits));
    if (Math.fround(number) === float) return number;
  }
  return Number(float.toPrecision(9));
}

// JSON has no integers of 64 bits, no NaN, and JSON.stringify() drops the sign of -0: these are strings.
function printable(value, type) {
  if (Array.isArray(value)) return value.map((one) => printable(one, type));
  if (typeof value === "bigint") return value.toString();
  if (typeof value !== "number") return value;
  if (Object.is(value, -0)) return "-0";
  if (!Number.isFinite(value)) return String(value);
  return type.startsWith("float") ? shortest(value) : value;
}

function decoded(packet) {
  const { seq, sysid, compid, msgid } = packet.header;
  const definition = DEFINITIONS[msgid];
  if (!definition) throw new Error(`message ${msgid} is neither of the minimal nor of the common message set`);
  const data = packet.protocol.data(packet.payload, definition);
  const fields = definition.FIELDS.map(({ source, name, type }) => [source, printable(data[name], type)]);
  return { sequence: seq, system: sysid, component: compid, id: msgid, name: definition.MSG_NAME,
           fields: Object.fromEntries(fields) };
}

async function packetsOf(file) {
  const packets = [];
  const splitter = new MavLinkPacketSplitter(), parser = new MavLinkPacketParser();
  splitter.pipe(parser).on("data", (packet) => packets.push(packet));
  splitter.end(await readFile(file));
  await once(parser, "end");
  return { packets, wrong: splitter.invalidPackages, unknown: splitter.unknownPackagesCount };
}

async function read(file) {
  const { packets, wrong, unknown } = await packetsOf(file);
  const bytes = packets.reduce((sum, packet) => sum + packet.buffer.length, 0);
  const lines = packets.map((packet) => JSON.stringify(decoded(packet)));
  console.log(`{"bytes":${bytes},"wrong_checksums":${wrong},"unknown":${unknown},"messages":[\n${lines.join(",\n")}\n]}`);
}

async function thin(file, thinned) {
  const EVERY = { ODOMETRY: 8, TIMESYNC: 40 };
  const { packets } = await packetsOf(file);
  const names = packets.map((packet) => decoded(packet).name), seen = {};
  const kept = packets.filter((packet, i) => {
    const name = names[i], count = (seen[name] = (seen[name] ?? 0) + 1);
    return count % (EVERY[name] ?? 1) === 0 || names.slice(Math.max(0, i - 1), i + 2).includes("STATUSTEXT");
  });
  await writeFile(thinned, Buffer.concat(kept.map((packet) => packet.buffer)));
}

const [mode, file, thinned] = process.argv.slice(2);
if (mode === "read" && file) {
  await read(file);
} else if (mode === "thin" && file && thinned) {
  await thin(file, thinned);
} else {
  console.error("usage: mavlink_peer.mjs read FILE | thin FILE THINNED");
  process.exit(2);
}
