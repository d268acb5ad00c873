// SPDX-License-Identifier: Apache-2.0
import { readFileSync, writeFileSync } from "node:fs";
import { join, resolve } from "node:path";
import { gzipSync } from "node:zlib";
import type { Plugin } from "vite";
import { defineConfig } from "vitest/config";

// The build tree contains a copy of console/ only.
const source = process.env["TANDEM_SOURCE"] ?? "..";
const server = process.env["TANDEM_SERVER"] ?? "http://127.0.0.1:8765";

/** Writes a compressed copy NAME.gz beside each file: the server sends it to browsers that accept gzip. */
const compressed: Plugin = {
  name: "compressed",
  writeBundle({ dir }, bundle) {
    for (const file of Object.keys(bundle).map((name) => join(dir!, name)))
      writeFileSync(`${file}.gz`, gzipSync(readFileSync(file), { level: 9 }));
  },
};

export default defineConfig({
  plugins: [compressed],
  resolve: {
    alias: { "@msg": resolve(source, "idl/msg") }, // message definitions in ROS 2 format, generated from idl/
  },
  build: {
    target: "es2022",
    assetsInlineLimit: 0, // no data: addresses, which the server's Content-Security-Policy does not allow
    chunkSizeWarningLimit: 1200,
    modulePreload: { polyfill: false },
  },
  server: {
    host: "127.0.0.1",
    fs: { allow: [source] },
    proxy: {
      "/api": server,
      "/ws": { target: server.replace("http", "ws"), ws: true, rewrite: () => "/" },
    },
  },
  test: { include: ["test/**/*.test.ts"], testTimeout: 120_000 }, // long, for a busy machine
});
