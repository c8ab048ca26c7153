import { defineConfig } from "vite";

export default defineConfig({
  base: "./", // a proxy may have the console under any path
  esbuild: { jsx: "automatic", jsxImportSource: "preact" },
  resolve: { alias: { "@api": decodeURIComponent(new URL("./generated/weft/v1", import.meta.url).pathname) } },
  build: {
    target: "es2022",
    // The content security policy lets nothing be loaded that stands within another file.
    assetsInlineLimit: 0,
    modulePreload: { polyfill: false },
    chunkSizeWarningLimit: 700, // kB; the largest one is three.js, loaded when a mesh is first shown
  },
});
