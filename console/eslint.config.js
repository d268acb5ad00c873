// SPDX-License-Identifier: Apache-2.0
// What typescript-eslint checks with types, in its strict set; deploy/lint.sh page runs it.
import tseslint from "typescript-eslint";

export default tseslint.config(
  tseslint.configs.strictTypeChecked,
  {
    languageOptions: { parserOptions: { project: true, tsconfigRootDir: import.meta.dirname } },
    rules: {
      "@typescript-eslint/no-non-null-assertion": "off", // x[k]! says that k is in range
      "@typescript-eslint/no-confusing-void-expression": "off", // callbacks in one line
      "@typescript-eslint/restrict-template-expressions": "off", // numbers in texts
      "@typescript-eslint/no-unnecessary-type-parameters": "off", // a topic's messages have the type that the reader names
      "@typescript-eslint/no-unnecessary-condition": "off", // does not see what a callback or a constructor sets
    },
  },
  { ignores: ["eslint.config.js", "src/wire/messages.ts", "generated/"] }, // the last two are made by idl/generate.py
);
