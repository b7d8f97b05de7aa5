// Read a bag's .mcap with Foxglove's own packages and print what they find.
//
//   npm install @mcap/core@2 @foxglove/rosmsg @foxglove/rosmsg2-serialization fzstd
//   node bags_npm.mjs BAG/BAG_0.mcap
import { open } from 'node:fs/promises';
import { McapIndexedReader } from '@mcap/core';
import rosmsg from '@foxglove/rosmsg';
import serialization from '@foxglove/rosmsg2-serialization';
import { decompress } from 'fzstd';

const file = await open(process.argv[2]);
const readable = {
  size: async () => BigInt((await file.stat()).size),
  read: async (offset, length) => {
    const buffer = new Uint8Array(Number(length));
    await file.read(buffer, 0, Number(length), Number(offset));
    return buffer;
  },
};
const reader = await McapIndexedReader.Initialize({
  readable,
  decompressHandlers: { zstd: (data) => decompress(data) },
});
const decoders = new Map();
for (const schema of reader.schemasById.values()) {
  const definition = rosmsg.parse(new TextDecoder().decode(schema.data), { ros2: true });
  decoders.set(schema.id, new serialization.MessageReader(definition));
}
const found = new Map();
for await (const message of reader.readMessages({ validateCrcs: true })) {
  const channel = reader.channelsById.get(message.channelId);
  const decoded = decoders.get(channel.schemaId).readMessage(message.data);
  const seen = found.get(channel.topic) ?? { count: 0, sum: 0, unequal: 0 };
  const stamp = BigInt(decoded.header.stamp.sec) * 1000000000n
    + BigInt(decoded.header.stamp.nanosec ?? decoded.header.stamp.nsec);
  seen.count += 1;
  seen.sum += decoded.accel.linear.z;
  seen.unequal += stamp === message.logTime ? 0 : 1;
  found.set(channel.topic, seen);
}
console.log('profile', reader.header.profile, 'messages', reader.statistics.messageCount);
for (const [topic, seen] of found) {
  console.log(topic, seen.count, 'sum of accel.linear.z', seen.sum, 'stamps unequal', seen.unequal);
}
await file.close();
