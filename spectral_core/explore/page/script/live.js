// SPDX-License-Identifier: GPL-3.0-or-later
// What a served page can do beyond looking: sample a region, refine, render, derive, label, apply a point.

/** The token that the server put into the address; it never leaves this page but to the server. */
const TOKEN = new URLSearchParams(location.hash.slice(1)).get("token") ?? "";

/** Ask the server. @param {string} action @param {any} content @returns {Promise<any>} */
export async function ask(action, content) {
  const answer = await fetch(`api/${action}`, {
    method: "POST",
    headers: { "Content-Type": "application/json", "X-Explore-Token": TOKEN },
    body: JSON.stringify(content),
  });
  const said = await answer.json();
  if (!answer.ok) throw new Error(said.error ?? `the server answered ${answer.status}`);
  return said;
}
