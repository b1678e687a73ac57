// Keyboard shortcuts of the page, except in input fields, and except keys that the focused element uses itself.

const OWN = { BUTTON: [" "], SUMMARY: [" "], SELECT: null, TEXTAREA: null, INPUT: null };

export function bindKeys(keys) {
  document.addEventListener("keydown", (event) => {
    if (event.ctrlKey || event.metaKey || event.altKey || document.querySelector("dialog[open]")) return;
    const tag = event.target.tagName;
    if (tag in OWN && (OWN[tag] === null || OWN[tag].includes(event.key)) && event.target.type !== "checkbox") return;
    if (event.target.type === "checkbox" && event.key === " ") return;
    const act = keys[event.key];
    if (!act) return;
    event.preventDefault();
    act(event);
  });
}
