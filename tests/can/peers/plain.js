// SPDX-License-Identifier: Apache-2.0
// An electronic data sheet as npm's canopen reads it. Vendors write blanks around "=", keys and sections in other letters, the node
// id before or behind a number, octal numbers, limits of signed types without their sign, empty names, and properties that CiA 306
// does not have for this kind of object, and several sub-indices as one (CompactSubObj).
"use strict";

const NAMES = new Map(
  [
    "ParameterName",
    "ObjectType",
    "DataType",
    "AccessType",
    "PDOMapping",
    "LowLimit",
    "HighLimit",
    "DefaultValue",
    "SubNumber",
  ].map((key) => [key.toLowerCase(), key]),
);
const SIGNED_BITS = { 2: 8, 3: 16, 4: 32 }; // by data type: INTEGER8, 16, 32
const VISIBLE_STRING = 9;
const DOMAIN = 2,
  ARRAY = 8,
  RECORD = 9; // object types

function number(text, id) {
  const parts = text.replace(/\$NODEID/gi, String(id)).split("+");
  return parts
    .map((part) => (/^\s*0[0-7]+\s*$/.test(part) ? parseInt(part, 8) : Number(part)))
    .reduce((a, b) => a + b, 0);
}

function valueOf(key, text, type, id) {
  if (["objecttype", "datatype", "subnumber"].includes(key)) return String(number(text, id));
  if (key === "accesstype") return text.toLowerCase();
  if (!["lowlimit", "highlimit", "defaultvalue"].includes(key) || type === VISIBLE_STRING) return text;
  const value = number(text, id);
  const bits = SIGNED_BITS[type];
  return Number.isNaN(value) ? null : String(bits && value >= 2 ** (bits - 1) ? value - 2 ** bits : value);
}

function propertiesOf(section) {
  const found = new Map([["parametername", "unnamed"]]);
  for (const line of section.split(/\r?\n/).slice(1)) {
    const [, key, text] = /^\s*(\w+)\s*=\s*(.*?)\s*$/.exec(line) ?? [];
    if (text) found.set(key.toLowerCase(), text);
  }
  return found;
}

function write(title, found, id) {
  const type = number(found.get("datatype") ?? "0", id);
  const lines = [`[${title}]`];
  for (const [key, text] of found) {
    const value = NAMES.has(key) ? valueOf(key, text, type, id) : null;
    if (value !== null) lines.push(`${NAMES.get(key)}=${value}`);
  }
  return `${lines.join("\n")}\n\n`;
}

function object(title, section, id) {
  const found = propertiesOf(section);
  const kind = number(found.get("objecttype") ?? "7", id);
  const ofItems = new Map(found).set("objecttype", "7");
  const items = Array.from({ length: number(found.get("compactsubobj") ?? "0", id) }, (_, k) =>
    write(`${title}sub${(k + 1).toString(16)}`, ofItems, id),
  );
  if (kind === DOMAIN) found.delete("pdomapping");
  if (kind === ARRAY || kind === RECORD)
    for (const key of ["datatype", "accesstype", "defaultvalue", "pdomapping", "lowlimit", "highlimit"])
      found.delete(key);
  return write(title, found, id) + items.join("");
}

/** The text of the same data sheet, for the node `id`. */
function plain(text, id) {
  return text
    .split(/^(?=\s*\[)/m)
    .map((section) => {
      const [, index, sub] = /^\s*\[([0-9A-F]{4})(sub[0-9A-F]+)?\]/i.exec(section) ?? [];
      return index
        ? object(index + (sub ?? "").toLowerCase(), section, id)
        : section.replace(/^\s*\[deviceinfo\]/i, "[DeviceInfo]");
    })
    .join("");
}

module.exports = { plain };
