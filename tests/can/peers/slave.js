// SPDX-License-Identifier: Apache-2.0
// A drive (CiA 402) and its encoder (CiA 406), built with npm's canopen: an implementation that shares only the data sheets with
// Tandem, and parses them itself.
//
//   node slave.js INTERFACE DRIVE_EDS DRIVE_ID ENCODER_EDS ENCODER_ID
//
// This file adds what the package leaves to the application: the boot-up message, the drive itself, which reduces the distance to its
// target by a third per SYNC, and, for data sheets written as vendors write them, plain.js.
"use strict";
const fs = require("fs");
const os = require("os");
const path = require("path");
const { Device, Eds, NmtState } = require("canopen");
const { createRawChannel } = require("socketcan");
const { plain } = require("./plain");

const [name, driveFile, driveId, encoderFile, encoderId] = process.argv.slice(2);
const channel = createRawChannel(name);

function load(file, id) {
  const copy = path.join(os.tmpdir(), `tandem-peer-${process.pid}-${path.basename(file)}`);
  fs.writeFileSync(copy, plain(fs.readFileSync(file, "latin1"), id));
  const eds = Eds.fromFile(copy);
  fs.unlinkSync(copy);
  eds.addSdoServerParameter(0, 0x580 + id, 0x600 + id, { saveDefault: true });
  return eds;
}

function device(file, id, restore) {
  const made = new Device({ id, eds: load(file, id) });
  let before = NmtState.INITIALIZING;
  made.nmt.on("changeState", (state) => {
    if (before === NmtState.INITIALIZING && state === NmtState.PRE_OPERATIONAL) {
      restore();
      channel.send({ id: 0x700 + id, data: Buffer.from([0]) });
    }
    before = state;
  });
  made.on("message", (message) => channel.send(message));
  channel.addListener("onMessage", (message) => made.receive(message));
  return made;
}

const COUNTS = 4096 * 10,
  ENCODER_COUNTS = 65536; // per turn of the lead screw
let position = 1234,
  encoderStart = 50000,
  power = "disabled";

function show() {
  const words = { disabled: 0x0250, ready: 0x0231, on: 0x0233, enabled: 0x1237 };
  drive.setValue(0x6041, words[power]);
  drive.setValue(0x6064, Math.round(position));
  drive.setValue(0x6061, drive.getValue(0x6060));
  encoder.setValue(0x6004, Math.round(encoderStart + (position * ENCODER_COUNTS) / COUNTS));
}

// One transition per SYNC.
function follow() {
  const control = drive.getValue(0x6040);
  const voltage = (control & 0x02) !== 0,
    quick = (control & 0x04) === 0;
  if (!voltage || quick) power = "disabled";
  else if ((control & 0x01) === 0) power = "ready";
  else if (power === "ready" && (control & 0x07) === 0x07) power = "on";
  else if (power === "on" && (control & 0x0f) === 0x0f) power = "enabled";
  else if (power === "enabled" && (control & 0x08) === 0) power = "on";
  if (power === "enabled") position += (drive.getValue(0x607a) - position) / 3;
  show();
}

const drive = device(driveFile, Number(driveId), () => {
  power = "disabled";
  show();
});
const encoder = device(encoderFile, Number(encoderId), () => show());
drive.sync.on("sync", follow);
channel.start();
drive.start();
encoder.start();
console.log("ready");
