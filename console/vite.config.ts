// SPDX-License-Identifier: Apache-2.0
import { resolve } from "node:path";
import { defineConfig } from "vitest/config";

// The build tree contains a copy of console/ only.
const source = process.env["TANDEM_SOURCE"] ?? "..";
const server = process.env["TANDEM_SERVER"] ?? "http://127.0.0.1:8765";

export default defineConfig({
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
