// The joints in the address, so that a pose can be mailed: #q=0,-1.5708,0 in rad and the file's length unit, and
// &p= with the runtime parameters where they are not those of the file.

function numbersOf(text) {
  const numbers = (text ?? "").split(",").map((word) => (word.trim() === "" ? NaN : Number(word)));
  return numbers.every(Number.isFinite) ? numbers : null;
}

// Takes what the address says; numbers of a wrong count or kind are left alone.
function readLink() {
  const said = new URLSearchParams(window.location.hash.slice(1));
  const parameters = said.has("p") ? numbersOf(said.get("p")) : null;
  if (parameters) app.setParameters(parameters, "link");
  const q = said.has("q") ? numbersOf(said.get("q")) : null;
  return q !== null && app.setJoints(q, "link");
}

let written = null;

app.writeLink = () => {
  const parts = [`q=${Array.from(app.state.q, (value) => String(value + 0)).join(",")}`];
  if (model.parameters.some((each, index) => each.value !== app.state.parameters[index])) {
    parts.push(`p=${Array.from(app.state.parameters, String).join(",")}`);
  }
  written = `#${parts.join("&")}`;
  if (window.location.hash === written) return;
  try {
    window.history.replaceState(null, "", written);
  } catch {
    // A page inside another one may not change its address.
  }
};

let timer = 0;

app.on("joints", ({ origin }) => {
  if (origin === "link" || origin === "start" || origin === "frame") return;
  window.clearTimeout(timer);
  timer = window.setTimeout(app.writeLink, 250);
});
window.addEventListener("hashchange", () => window.location.hash !== written && readLink());
