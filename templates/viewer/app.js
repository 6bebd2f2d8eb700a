// What all files share: the robot, its kernels, the present joints and parameters, and events.
//
// app.model        the JSON of the page (see kinegen/tools/viewer/data.py); numbers in rad and the file's length unit
// app.kernels      what the emitted module exports: fk, frames, jacobian, and inverse where there is one
// app.state        {q: Float64Array, parameters: Float64Array, unit: "deg" | "rad"}; changed by the functions below
// app.on(event, handler), app.emit(event, detail)
//   "joints"       joints or parameters have changed; detail {origin}
//   "parameters"   parameters have changed (then "joints" follows); detail {origin}
//   "row"          a row of the table is pointed at; detail its index in app.model.rows, or null
//   "unit"         degrees or radians; detail the unit
//   "theme"        light or dark; detail the name
//   "draw"         before each picture: the place to move things
const model = JSON.parse(document.getElementById("model").textContent);

const app = {
  model,
  kernels,
  state: {
    q: new Float64Array(model.joints.length),
    parameters: Float64Array.from(model.parameters, (each) => each.value),
    unit: model.units.angle,
  },
};

const handlers = new Map();

app.on = (event, handler) => {
  if (!handlers.has(event)) handlers.set(event, []);
  handlers.get(event).push(handler);
};

app.emit = (event, detail) => {
  for (const handler of handlers.get(event) ?? []) handler(detail);
};

// The joint vector; numbers that are not finite are refused. Origin names the part that asks, which can ignore the echo.
app.setJoints = (q, origin) => {
  if (q.length !== app.state.q.length || !Array.from(q).every(Number.isFinite)) return false;
  app.state.q.set(q);
  changed(origin);
  return true;
};

app.setJoint = (index, value, origin) => {
  const q = app.state.q.slice();
  q[index] = value;
  return app.setJoints(q, origin);
};

app.setParameters = (parameters, origin) => {
  const numbers = Array.from(parameters);
  if (numbers.length !== app.state.parameters.length || !numbers.every(Number.isFinite)) return false;
  app.state.parameters.set(numbers);
  app.emit("parameters", { origin });
  changed(origin);
  return true;
};

app.setUnit = (unit) => {
  app.state.unit = unit;
  app.emit("unit", unit);
};

let present = null;

function changed(origin) {
  present = null;
  app.emit("joints", { origin });
  app.three?.requestDraw();
}

// Calls a kernel of the page with the present parameters: app.evaluate("fk", q).
app.evaluate = (name, ...inputs) => {
  const given = model.parameters.length ? [namedParameters()] : [];
  return app.kernels[name](...inputs, ...given);
};

function namedParameters() {
  return Object.fromEntries(model.parameters.map((each, index) => [each.name, app.state.parameters[index]]));
}

// The 4x4 matrices in the base, row by row, of every frame of app.model.frames, in that order.
app.frames = () => {
  if (present === null) present = matricesOf(app.evaluate("frames", app.state.q));
  return present;
};

function matricesOf(numbers) {
  return Array.from({ length: numbers.length / 16 }, (_, index) => numbers.slice(16 * index, 16 * index + 16));
}

const places = new Map(model.frames.map((frame, index) => [frame.name, index]));

// The matrix of a frame by name; that of app.model.root, the base, is the identity.
app.frame = (name) => (places.has(name) ? app.frames()[places.get(name)] : identity());

// The matrix from which a row starts: its parent, or for the first rows the frame after the fixed base transform.
app.rowStart = (row) => (places.has(row.parent) ? app.frame(row.parent) : product(model.base));

// The matrices on the way from the parent of a row to its frame: before each of its elementary transforms, and the last.
app.rowSteps = (row) => {
  const found = [app.rowStart(row)];
  for (const step of row.steps) found.push(multiply(found.at(-1), elementary(step.kind, valueOf(step.value))));
  return found;
};

// Elementary transforms one after the other, from a matrix on.
function product(steps, start = identity()) {
  return steps.reduce((matrix, step) => multiply(matrix, elementary(step.kind, valueOf(step.value))), start);
}

// An element with attributes and children; text is text, never markup.
app.element = (name, attributes = {}, ...children) => {
  const made = document.createElement(name);
  for (const [key, value] of Object.entries(attributes)) {
    if (value === true) made.setAttribute(key, "");
    else if (value !== false && value !== null) made.setAttribute(key, value);
  }
  made.append(...children);
  return made;
};
const element = app.element;
