// The side bar, the title and the buttons above the picture.

const side = document.getElementById("side");

// A section that folds, with a heading; returns the element for its content.
app.panel = (id, title, isOpen = true) => {
  const body = element("div", { class: "body" });
  const summary = element("summary", {}, element("h2", {}, title));
  side.append(element("details", { id, class: "panel", open: isOpen }, summary, body));
  return body;
};

// A button; one that is pressed or not calls back with the new state.
app.button = (text, title, action) => {
  const made = element("button", { type: "button", title }, text);
  made.addEventListener("click", action);
  return made;
};
app.toggle = (text, title, isOn, action) => {
  const made = app.button(text, title, () => {
    const wanted = made.getAttribute("aria-pressed") !== "true";
    made.setAttribute("aria-pressed", String(wanted));
    action(wanted);
  });
  made.setAttribute("aria-pressed", String(isOn));
  return made;
};

document.getElementById("name").textContent = model.name;
document.getElementById("description").textContent = model.description;
canvas.setAttribute("aria-label", `${model.name}, drawn; drag or Shift and arrows to turn, right button or arrows to shift, wheel or + and - to zoom`);

// Where to look from, and apart from these what to show.
const tools = document.getElementById("tools");
const group = (label, ...buttons) => element("div", { class: "group", role: "group", "aria-label": label }, ...buttons);
const dark = app.toggle("Dark", "Light or dark colours", app.theme() === "dark", (wanted) => app.setTheme(wanted ? "dark" : "light"));
tools.append(
  group(
    "Camera",
    app.button("Fit", "Show the whole arm (F)", () => fit()),
    app.button("Front", "Look along y", () => fit(new THREE.Vector3(0.001, -1, 0.02))),
    app.button("Top", "Look along -z", () => fit(new THREE.Vector3(0, -0.001, 1))),
    app.button("Isometric", "Look from the front, the right and above", () => fit(ISOMETRIC.clone())),
  ),
  group(
    "Show",
    app.toggle("Frames", "Show the axes of the frames", true, app.showFrames),
    app.toggle("Labels", "Show the names of the frames", true, app.showLabels),
    app.toggle("X-ray", "Make the arm transparent", false, app.setXray),
    dark,
  ),
);
app.on("theme", (theme) => dark.setAttribute("aria-pressed", String(theme === "dark")));

// How to move the view, until it has been moved; and what the picture is made of.
const isTouch = window.matchMedia("(pointer: coarse)").matches;
const hint = element(
  "p",
  { id: "hint" },
  isTouch ? "One finger rotates, two fingers pan and zoom." : "Drag to rotate, right-drag to pan, scroll to zoom.",
);
const about = element("p", { id: "about" }, model.links ? "Drawn from the joints, without the meshes of the file." : "Drawn from the table.");
document.getElementById("stage").append(element("div", { id: "legend" }, about, hint));
controls.addEventListener("start", () => (hint.hidden = true));
