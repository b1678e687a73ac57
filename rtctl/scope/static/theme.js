// Dark or light theme: by the system, or by the button.

const NEXT = { system: "dark", dark: "light", light: "system" };
const dark = matchMedia("(prefers-color-scheme: dark)");

export function bindTheme(button, changed) {
  let chosen = localStorage.getItem("scope theme") ?? "system";
  const apply = () => {
    document.documentElement.dataset.theme = chosen === "system" ? (dark.matches ? "dark" : "light") : chosen;
    button.textContent = `Theme: ${chosen}`;
  };
  button.onclick = () => {
    chosen = NEXT[chosen] ?? "dark";
    localStorage.setItem("scope theme", chosen);
    apply();
    changed();
  };
  dark.addEventListener("change", () => { apply(); changed(); });
  apply();
}
