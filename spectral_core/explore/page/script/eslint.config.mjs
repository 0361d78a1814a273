// SPDX-License-Identifier: GPL-3.0-or-later
// Rules for the page's script modules: what is undefined, unused, shadowed or unsafe is an error.

const browser = ["window", "document", "localStorage", "location", "fetch", "atob", "performance", "requestAnimationFrame",
  "setTimeout", "clearTimeout", "getComputedStyle", "URL", "URLSearchParams", "Blob", "Option", "Intl"];

export default [
  {
    files: ["**/*.js"],
    languageOptions: { ecmaVersion: 2022, sourceType: "module", globals: Object.fromEntries(browser.map((name) => [name, "readonly"])) },
    rules: {
      "no-undef": "error", "no-unused-vars": "error", "no-shadow": "error", "no-eval": "error", "no-implied-eval": "error",
      "no-new-func": "error", "no-var": "error", "prefer-const": "error", "eqeqeq": "error", "no-fallthrough": "error",
      "no-unreachable": "error", "no-dupe-keys": "error", "no-self-compare": "error", "no-throw-literal": "error",
      "no-restricted-properties": ["error", { property: "innerHTML" }, { property: "outerHTML" }, { property: "insertAdjacentHTML" }],
    },
  },
];
