// A slider and a number field for each joint, home, random, degrees or radians.

const RANGE_STEPS = 2000;

// Rows of controls for numbers with a range; joints and actuators share them.
//
// items: {name, isAngle, unit, low, high, isLimited}; read(index) gives a value in kernel units, write(index, value)
// takes one. Returns {element, show}, where show() writes the present values into the fields.
function sliders(items, read, write) {
  const list = element("div", { class: "sliders" });
  const rows = items.map((item, index) => sliderRow(item, index, write));
  list.append(...rows.map((row) => row.element));
  const show = () => rows.forEach((row, index) => row.show(read(index)));
  return { element: list, show };
}

function sliderRow(item, index, write) {
  const id = `value-${item.key}-${index}`;
  const range = element("input", { type: "range", min: 0, max: RANGE_STEPS, step: 1, "aria-label": `${item.name}, slider` });
  const field = element("input", { type: "number", step: "any", id, autocomplete: "off" });
  const unit = element("span", { class: "unit" });
  const label = element("label", { for: id }, item.name);
  const low = element("span", { class: "limit" });
  const high = element("span", { class: "limit" });
  const middle = element("span", { class: "limit" }, item.isLimited ? "" : item.bounds ?? "no limits");
  const ends = element("div", { class: "ends", "aria-hidden": "true" }, low, middle, high);
  const width = item.high - item.low || 1;
  // The bar is filled from zero, or from the end next to it.
  const share = (value) => Math.min(Math.max((value - item.low) / width, 0), 1);
  range.style.setProperty("--zero", share(0));
  range.addEventListener("input", () => write(index, item.low + (width * range.valueAsNumber) / RANGE_STEPS));
  field.addEventListener("input", () => {
    if (Number.isFinite(field.valueAsNumber)) write(index, app.taken(field.valueAsNumber, item.isAngle));
  });
  field.addEventListener("blur", () => show(item.value));
  field.addEventListener("keydown", (event) => {
    const sign = { ArrowUp: 1, ArrowDown: -1 }[event.key];
    if (!sign) return;
    event.preventDefault();
    const moved = app.shown(item.value, item.isAngle) + sign * nudge(item) * (event.shiftKey ? 10 : 1);
    field.value = shortNumber(moved);
    write(index, app.taken(moved, item.isAngle));
  });

  const show = (value) => {
    item.value = value;
    const outside = item.isLimited && (value < item.low || value > item.high);
    range.value = Math.round(share(value) * RANGE_STEPS);
    range.style.setProperty("--from", Math.min(share(0), share(value)));
    range.style.setProperty("--to", Math.max(share(0), share(value)));
    const number = shortNumber(app.shown(value, item.isAngle), 4, width);
    const text = `${number} ${shownUnit(item)}`;
    range.setAttribute("aria-valuetext", outside ? `${text}, outside its limits` : text);
    if (document.activeElement !== field) field.value = number;
    field.setAttribute("aria-invalid", String(outside));
    row.classList.toggle("outside", outside);
    unit.textContent = shownUnit(item);
    low.textContent = shortNumber(app.shown(item.low, item.isAngle), endDigits(item));
    high.textContent = shortNumber(app.shown(item.high, item.isAngle), endDigits(item));
  };
  const row = element("div", { class: "slider" }, label, range, field, unit, ends);
  return { element: row, show };
}

function endDigits(item) {
  return item.isAngle && app.state.unit === "deg" ? 1 : 3;
}

// What an arrow key adds: a degree, 0.01 rad, or about a hundredth of the range.
function nudge(item) {
  if (item.isAngle) return app.state.unit === "deg" ? 1 : 0.01;
  return 10 ** Math.round(Math.log10((item.high - item.low || 1) / 100));
}

function shownUnit(item) {
  return item.isAngle ? app.state.unit : item.unit;
}

// Few digits, no trailing zeros; what is next to nothing of the range is zero.
function shortNumber(value, digits = 4, scale = 1) {
  if (!Number.isFinite(value)) return "";
  if (Math.abs(value) < 1e-9 * Math.min(1, scale)) return "0";
  return String(Number(Math.abs(value) >= 1 ? value.toFixed(digits) : value.toPrecision(digits)));
}

function jointItem(joint) {
  const [low, high] = joint.limits ?? joint.range;
  const followers = joint.followers.length ? ` (moves ${joint.followers.join(", ")} too)` : "";
  return { key: "joint", name: joint.name + followers, isAngle: joint.angle, unit: model.units.length, low, high, isLimited: joint.limits !== null, bounds: model.actuators.length ? "range of the actuators" : "no limits" };
}

app.home = () => Float64Array.from(model.joints, (joint) => joint.home);

// Within the limits; actuators do not reach every joint vector, so theirs are drawn instead.
function randomJoints() {
  const between = ([low, high]) => low + Math.random() * (high - low);
  const { actuators_to_joints: forth } = app.kernels;
  const isWithin = (value, index) => Number.isFinite(value) && (model.joints[index].limits ?? [-Infinity, Infinity]).every((end, side) => (side ? value <= end : value >= end));
  for (let tries = 0; forth && tries < 100; tries++) {
    const q = app.evaluate("actuators_to_joints", Float64Array.from(model.actuators, (each) => between(boundsOf(each))));
    if (q.every(isWithin)) return q;
  }
  return Float64Array.from(model.joints, (joint) => between(joint.range));
}

function unitChoice() {
  const choices = ["deg", "rad"].map((unit) => {
    const radio = element("input", { type: "radio", name: "unit", value: unit, id: `unit-${unit}`, checked: app.state.unit === unit });
    radio.addEventListener("change", () => app.setUnit(unit));
    return element("label", { for: `unit-${unit}` }, radio, unit === "deg" ? "degrees" : "radians");
  });
  return element("fieldset", { class: "choice" }, element("legend", { class: "hidden" }, "Unit of angles"), ...choices);
}

function buildJoints() {
  const body = app.panel("joints", "Joints");
  if (!model.joints.length) {
    body.append(element("p", {}, "This robot has no joints."), unitChoice());
    return;
  }
  const made = sliders(model.joints.map(jointItem), (index) => app.state.q[index], (index, value) => app.setJoint(index, value, "joints"));
  const home = app.button("Home", model.actuators.length ? "The first pose (H)" : "Every joint at 0, or at the nearest limit (H)", () => app.setJoints(app.home(), "home"));
  const random = app.button("Random", "A joint vector within the limits", () => app.setJoints(randomJoints(), "random"));
  body.append(element("div", { class: "bar" }, home, random, unitChoice()), made.element);
  app.on("joints", made.show);
  app.on("unit", made.show);
  made.show();
}

buildJoints();
