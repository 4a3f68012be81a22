// SPDX-License-Identifier: BSD-3-Clause
// Writes and reads MCAP files of ROS 2 messages with packages of others, to check RO-SLAM against.
//
//   npm install --prefix DIR @mcap/core @foxglove/rosmsg @foxglove/rosmsg2-serialization \
//       @foxglove/wasm-lz4 @foxglove/wasm-zstd lz4js
//   ROSLAM_NODE_PACKAGES=DIR node tests/mcap_peer.mjs write FILE none|lz4|zstd
//   ROSLAM_NODE_PACKAGES=DIR node tests/mcap_peer.mjs read FILE
//
// write: 10 frames of 64x48 with a pattern, and an inertial unit; tests/mcap_peer_test.cpp knows the numbers.
// read: prints one JSON object: the topics with their types, counts and times and the last message of each, its long
// arrays as lengths; the count of messages by the index. A wrong checksum ends it.
import { createRequire } from "node:module";
import { open, readFile, writeFile } from "node:fs/promises";
import path from "node:path";

const folder = process.env.ROSLAM_NODE_PACKAGES ?? ".";
const load = createRequire(path.resolve(folder, "package.json"));
const { McapWriter, McapStreamReader, McapIndexedReader } = load("@mcap/core");
const { parse } = load("@foxglove/rosmsg");
const { MessageReader, MessageWriter } = load("@foxglove/rosmsg2-serialization");
const lz4 = load("@foxglove/wasm-lz4");
const zstd = load("@foxglove/wasm-zstd");
const { compress: compressLz4 } = load("lz4js");

const HEADER = `std_msgs/Header header
`;
const HEADER_TYPE = `================================================================================
MSG: std_msgs/Header
builtin_interfaces/Time stamp
string frame_id
`;
const VECTOR_TYPES = `================================================================================
MSG: geometry_msgs/Vector3
float64 x
float64 y
float64 z
================================================================================
MSG: geometry_msgs/Quaternion
float64 x 0
float64 y 0
float64 z 0
float64 w 1
`;
const DEFINITIONS = {
  "sensor_msgs/msg/Image": HEADER + `uint32 height
uint32 width
string encoding
uint8 is_bigendian
uint32 step
uint8[] data
` + HEADER_TYPE,
  "sensor_msgs/msg/CameraInfo": HEADER + `uint32 height
uint32 width
string distortion_model
float64[] d
float64[9] k
float64[9] r
float64[12] p
uint32 binning_x
uint32 binning_y
sensor_msgs/RegionOfInterest roi
` + HEADER_TYPE + `================================================================================
MSG: sensor_msgs/RegionOfInterest
uint32 x_offset
uint32 y_offset
uint32 height
uint32 width
bool do_rectify
`,
  "sensor_msgs/msg/Imu": HEADER + `geometry_msgs/Quaternion orientation
float64[9] orientation_covariance
geometry_msgs/Vector3 angular_velocity
float64[9] angular_velocity_covariance
geometry_msgs/Vector3 linear_acceleration
float64[9] linear_acceleration_covariance
` + HEADER_TYPE + VECTOR_TYPES,
  "tf2_msgs/msg/TFMessage": `geometry_msgs/TransformStamped[] transforms
================================================================================
MSG: geometry_msgs/TransformStamped
std_msgs/Header header
string child_frame_id
geometry_msgs/Transform transform
================================================================================
MSG: geometry_msgs/Transform
geometry_msgs/Vector3 translation
geometry_msgs/Quaternion rotation
` + HEADER_TYPE + VECTOR_TYPES,
};

const WIDTH = 64, HEIGHT = 48, FRAMES = 10, SAMPLES_PER_FRAME = 20;
const BEGIN = 1700000000123456789n, INTERVAL = 100000000n; // nanoseconds
const OPTICAL = "camera_color_optical_frame", INERTIAL = "camera_imu_frame";

function header(time, frame) {
  return { stamp: { sec: Number(time / 1000000000n), nsec: Number(time % 1000000000n) }, frame_id: frame };
}

function image(time, encoding, bytesPerPixel, fill) {
  const data = new Uint8Array(WIDTH * HEIGHT * bytesPerPixel);
  const view = new DataView(data.buffer);
  for (let v = 0; v < HEIGHT; ++v)
    for (let u = 0; u < WIDTH; ++u) fill(view, (v * WIDTH + u) * bytesPerPixel, u, v);
  return { header: header(time, OPTICAL), height: HEIGHT, width: WIDTH, encoding, is_bigendian: 0,
           step: WIDTH * bytesPerPixel, data };
}

function colour(time, i) {
  return image(time, "rgb8", 3, (view, at, u, v) => [4 * u, 5 * v, 20 * i].forEach((c, k) => view.setUint8(at + k, c)));
}

function depth(time, i) {
  return image(time, "16UC1", 2, (view, at, u, v) => view.setUint16(at, v === 0 ? 0 : 1000 + 10 * i + u, true));
}

function cameraInfo(time) {
  return { header: header(time, OPTICAL), height: HEIGHT, width: WIDTH, distortion_model: "plumb_bob",
           d: [0.01, -0.02, 0.0003, 0.0004, 0.005], k: [60, 0, 31.5, 0, 61, 23.5, 0, 0, 1],
           r: [1, 0, 0, 0, 1, 0, 0, 0, 1], p: [60, 0, 31.5, 0, 0, 61, 23.5, 0, 0, 0, 1, 0],
           binning_x: 0, binning_y: 0,
           roi: { x_offset: 0, y_offset: 0, height: 0, width: 0, do_rectify: false } };
}

function inertial(time, n) {
  const none = new Float64Array(9);
  return { header: header(time, INERTIAL), orientation: { x: 0, y: 0, z: 0, w: 1 }, orientation_covariance: none,
           angular_velocity: { x: 0.001 * n, y: 0.2, z: -0.3 }, angular_velocity_covariance: none,
           linear_acceleration: { x: 0.5, y: -9.7, z: 0.001 * n }, linear_acceleration_covariance: none };
}

function placement(time) {
  return { transforms: [{ header: header(time, OPTICAL), child_frame_id: INERTIAL,
                          transform: { translation: { x: 0.03, y: -0.01, z: 0.002 },
                                       rotation: { x: 0, y: 0, z: 0, w: 1 } } }] };
}

const COMPRESSIONS = {
  none: undefined,
  lz4: (bytes) => ({ compression: "lz4", compressedData: new Uint8Array(compressLz4(bytes)) }),
  zstd: (bytes) => ({ compression: "zstd", compressedData: new Uint8Array(zstd.compress(bytes)) }),
};

async function write(file, compression) {
  if (!(compression in COMPRESSIONS)) throw new Error(`compression must be none, lz4 or zstd, not ${compression}`);
  await zstd.isLoaded;
  const parts = [];
  let length = 0n;
  const writable = { write: async (bytes) => { parts.push(bytes.slice()); length += BigInt(bytes.length); },
                     position: () => length };
  const writer = new McapWriter({ writable, chunkSize: 20000, compressChunk: COMPRESSIONS[compression] });
  await writer.start({ profile: "ros2", library: "" });
  const serializers = {}, schemas = {}, sequence = {};
  const addTopic = async (topic, type) => {
    serializers[type] ??= new MessageWriter(parse(DEFINITIONS[type], { ros2: true }));
    schemas[type] ??= await writer.registerSchema(
      { name: type, encoding: "ros2msg", data: new TextEncoder().encode(DEFINITIONS[type]) });
    const channelId = await writer.registerChannel(
      { topic, schemaId: schemas[type], messageEncoding: "cdr", metadata: new Map() });
    return async (time, message) => {
      sequence[topic] = (sequence[topic] ?? 0) + 1;
      await writer.addMessage({ channelId, sequence: sequence[topic], logTime: time, publishTime: time,
                                data: serializers[type].writeMessage(message) });
    };
  };
  const putColour = await addTopic("/camera/color/image_raw", "sensor_msgs/msg/Image");
  const putInfo = await addTopic("/camera/color/camera_info", "sensor_msgs/msg/CameraInfo");
  const putDepth = await addTopic("/camera/aligned_depth_to_color/image_raw", "sensor_msgs/msg/Image");
  const putDepthInfo = await addTopic("/camera/aligned_depth_to_color/camera_info", "sensor_msgs/msg/CameraInfo");
  const putInertial = await addTopic("/camera/imu", "sensor_msgs/msg/Imu");
  const putPlacement = await addTopic("/tf_static", "tf2_msgs/msg/TFMessage");
  await putPlacement(BEGIN, placement(BEGIN));
  for (let i = 0; i < FRAMES; ++i) {
    const time = BEGIN + BigInt(i) * INTERVAL;
    await putInfo(time, cameraInfo(time));
    await putDepthInfo(time, cameraInfo(time));
    await putColour(time, colour(time, i));
    await putDepth(time, depth(time, i));
    for (let k = 0; k < SAMPLES_PER_FRAME; ++k) {
      const at = time + (BigInt(k) * INTERVAL) / BigInt(SAMPLES_PER_FRAME);
      await putInertial(at, inertial(at, i * SAMPLES_PER_FRAME + k));
    }
  }
  await writer.end();
  await writeFile(file, Buffer.concat(parts));
}

// The sizes of arrays and the values of what is short; objects likewise.
function outline(value) {
  if (ArrayBuffer.isView(value) || Array.isArray(value)) {
    const isShort = value.length <= 12 && typeof value[0] !== "object";
    return isShort ? Array.from(value) : { length: value.length, first: outline(value[0]) };
  }
  if (typeof value === "bigint") return value.toString();
  if (value === null || typeof value !== "object") return value;
  return Object.fromEntries(Object.entries(value).map(([name, field]) => [name, outline(field)]));
}

const DECOMPRESSIONS = { lz4: (bytes, size) => lz4(bytes, Number(size)),
                         zstd: (bytes, size) => zstd.decompress(bytes, Number(size)) };

// The messages of the file one after the other, with all checksums verified.
function readStream(bytes) {
  const reader = new McapStreamReader({ decompressHandlers: DECOMPRESSIONS, validateCrcs: true });
  reader.append(bytes);
  const schemas = new Map(), channels = new Map(), topics = {}, records = {};
  for (let record = reader.nextRecord(); record; record = reader.nextRecord()) {
    records[record.type] = (records[record.type] ?? 0) + 1;
    if (record.type === "Schema") schemas.set(record.id, record);
    if (record.type === "Channel") channels.set(record.id, record);
    if (record.type !== "Message") continue;
    const channel = channels.get(record.channelId), schema = schemas.get(channel.schemaId);
    const topic = (topics[channel.topic] ??= { type: schema?.name, encoding: channel.messageEncoding, messages: 0,
                                               bytes: 0, begin: record.logTime.toString() });
    topic.messages += 1;
    topic.bytes += record.data.length;
    topic.end = record.logTime.toString();
    if (schema?.encoding === "ros2msg" && schema.data.length > 0) {
      channel.reader ??= new MessageReader(parse(new TextDecoder().decode(schema.data), { ros2: true }));
      topic.last = outline(channel.reader.readMessage(record.data));
    }
  }
  return { records, topics, is_whole: reader.done() };
}

// The number of messages that are found by the index, and what the statistics say.
async function readIndex(file) {
  const handle = await open(file);
  try {
    const readable = { size: async () => BigInt((await handle.stat()).size),
                       read: async (offset, length) => {
                         const buffer = new Uint8Array(Number(length));
                         await handle.read(buffer, 0, Number(length), Number(offset));
                         return buffer;
                       } };
    const reader = await McapIndexedReader.Initialize({ readable, decompressHandlers: DECOMPRESSIONS });
    let messages = 0, isOrdered = true, last = -1n;
    for await (const message of reader.readMessages({ validateCrcs: true })) {
      messages += 1;
      isOrdered &&= message.logTime >= last;
      last = message.logTime;
    }
    return { messages, is_ordered: isOrdered, chunks: reader.chunkIndexes.length,
             statistics: Number(reader.statistics?.messageCount ?? -1n), profile: reader.header.profile };
  } finally {
    await handle.close();
  }
}

async function read(file) {
  await Promise.all([lz4.isLoaded, zstd.isLoaded]);
  const stream = readStream(await readFile(file));
  console.log(JSON.stringify({ ...stream, index: await readIndex(file) }, null, 1));
}

const [mode, file, compression] = process.argv.slice(2);
if (mode === "write" && file && compression) {
  await write(file, compression);
} else if (mode === "read" && file) {
  await read(file);
} else {
  console.error("usage: mcap_peer.mjs write FILE none|lz4|zstd | read FILE");
  process.exit(2);
}
