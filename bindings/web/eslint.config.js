import js from "@eslint/js";
import globals from "globals";

export default [
  { ignores: ["dist/", "node_modules/"] },
  js.configs.recommended,
  {
    rules: { eqeqeq: ["error", "always", { null: "ignore" }], "no-var": "error", "prefer-const": "error", "no-control-regex": "off", "no-unused-vars": ["error", { varsIgnorePattern: "^_" }] },
  },
  { files: ["page/*.js"], languageOptions: { globals: globals.browser } },
  { files: ["page/sw.js"], languageOptions: { globals: globals.serviceworker } },
  { files: ["build.mjs", "tests/*.mjs"], languageOptions: { globals: { ...globals.node, ...globals.browser } } },
];
