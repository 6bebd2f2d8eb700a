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

const tools = document.getElementById("tools");
tools.append(
  app.button("Fit", "Show the whole arm (F)", () => fit()),
  app.button("Front", "Look along y", () => fit(new THREE.Vector3(0.001, -1, 0.02))),
  app.button("Top", "Look along -z", () => fit(new THREE.Vector3(0, -0.001, 1))),
  app.button("Oblique", "Look from the front, the side and above", () => fit(new THREE.Vector3(1.2, -1.5, 0.85))),
  app.toggle("Frames", "Show the axes of the frames", true, app.showFrames),
  app.toggle("Names", "Show the names of the frames", true, app.showNames),
  app.toggle("See through", "Make the arm transparent", false, app.seeThrough),
  app.toggle("Dark", "Light or dark colours", app.theme() === "dark", (wanted) => app.setTheme(wanted ? "dark" : "light")),
);
app.on("theme", (theme) => tools.lastElementChild.setAttribute("aria-pressed", String(theme === "dark")));
