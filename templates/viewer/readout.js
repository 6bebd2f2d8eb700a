// The pose of a frame in the base as matrix and as orientation in the usual forms; joints and pose as text to copy.

const FORMS = [
  { title: "Quaternion w x y z", values: quaternion, isAngle: false },
  { title: "Roll pitch yaw, Rz(yaw) Ry(pitch) Rx(roll)", values: rollPitchYaw, isAngle: true },
  { title: "Euler phi theta psi, Rz Ry Rz", values: eulerZyz, isAngle: true },
  { title: "Rotation vector", values: rotationVector, isAngle: true },
];

// Decimals of lengths that show a millionth of the arm.
const lengthDigits = Math.max(0, Math.min(12, 6 - Math.floor(Math.log10(app.size) + 1e-9)));

// Texts of numbers with all their digits, as each language writes lists.
const LANGUAGES = {
  python: {
    title: "Python",
    joints: (q) => `q = [${q.map(full).join(", ")}]  # ${kernelUnits()}`,
    pose: (name, rows) => `base_T_${name} = [\n${rows.map((row) => `    [${row.map(full).join(", ")}],\n`).join("")}]`,
  },
  c: {
    title: "C",
    joints: (q) => `const double q[${Math.max(1, q.length)}] = {${q.map(full).join(", ")}}; /* ${kernelUnits()} */`,
    pose: (name, rows) => `const double base_T_${name}[16] = {\n${rows.map((row) => `    ${row.map(full).join(", ")},\n`).join("")}};`,
  },
  yaml: {
    title: "YAML",
    joints: (q) => `q: [${q.map(full).join(", ")}]  # ${kernelUnits()}`,
    pose: (name, rows) => `base_T_${name}:\n${rows.map((row) => `  - [${row.map(full).join(", ")}]`).join("\n")}`,
  },
};

// The shortest text that reads back as the same number, and as a floating-point one.
function full(value) {
  const text = String(value + 0);
  return /[.e]/.test(text) ? text.replace(/^(-?\d+)e/, "$1.0e") : `${text}.0`;
}

function kernelUnits() {
  const kinds = new Set(model.joints.map((joint) => (joint.angle ? "rad" : model.units.length)));
  return [...kinds].join(" and ") || "no joints";
}

function rowsOf(m) {
  return [0, 4, 8, 12].map((start) => Array.from(m.slice(start, start + 4)));
}

function matrixTable() {
  const cells = Array.from({ length: 16 }, () => element("td"));
  const rows = [0, 4, 8, 12].map((start) => element("tr", {}, ...cells.slice(start, start + 4)));
  const table = element("table", { class: "matrix" }, element("caption"), element("tbody", {}, ...rows));
  return { table, cells, caption: table.caption };
}

function frameChoice() {
  const tips = new Set(model.tips);
  const names = [...model.tips, ...model.frames.map((each) => each.name).filter((name) => !tips.has(name))];
  return element("select", { id: "pose-frame" }, ...names.map((name) => element("option", { value: name }, name)));
}

async function copy(area, status) {
  try {
    await navigator.clipboard.writeText(area.value);
  } catch {
    area.select();
    if (!document.execCommand("copy")) {
      status.textContent = "The browser does not allow it: select the text and copy it.";
      return;
    }
  }
  status.textContent = "Copied.";
}

function buildPose() {
  const body = app.panel("pose", "Pose");
  const choice = frameChoice();
  const { table, cells, caption } = matrixTable();
  const forms = FORMS.map((form) => ({ ...form, cell: element("dd"), head: element("dt") }));
  body.append(
    element("div", { class: "field" }, element("label", { for: "pose-frame" }, "Frame"), choice),
    table,
    element("dl", { class: "forms" }, ...forms.flatMap((form) => [form.head, form.cell])),
  );
  const show = () => {
    const m = app.frame(choice.value);
    caption.textContent = `Pose in ${model.rootLabel}, ${model.units.length}`;
    cells.forEach((cell, index) => (cell.textContent = decimal(m[index], index % 4 === 3 && index < 12 ? lengthDigits : 6)));
    for (const form of forms) {
      form.head.textContent = form.isAngle ? `${form.title}, ${app.state.unit}` : form.title;
      form.cell.textContent = form.values(m).map((value) => decimal(app.shown(value, form.isAngle), form.isAngle && app.state.unit === "deg" ? 4 : 6)).join("  ");
    }
  };
  choice.addEventListener("change", () => {
    show();
    app.emit("joints", { origin: "frame" });
  });
  app.on("joints", show);
  app.on("unit", show);
  show();
  return choice;
}

function buildCopy(frame) {
  const body = app.panel("copy", "Copy", false);
  const what = element("select", { id: "copy-what" }, element("option", { value: "joints" }, "joint vector"), element("option", { value: "pose" }, "pose"));
  const language = element("select", { id: "copy-language" }, ...Object.entries(LANGUAGES).map(([value, { title }]) => element("option", { value }, title)));
  const area = element("textarea", { id: "copy-text", readonly: true, rows: 6, spellcheck: "false", "aria-label": "Text to copy" });
  const status = element("span", { class: "note", role: "status" });
  const show = () => {
    const made = LANGUAGES[language.value];
    area.value = what.value === "joints" ? made.joints(Array.from(app.state.q)) : made.pose(frame.value, rowsOf(app.frame(frame.value)));
    status.textContent = "";
  };
  const button = app.button("Copy", "Put the text on the clipboard", () => copy(area, status));
  const link = app.button("Copy link", "The address of this page with the present joints", () => {
    app.writeLink();
    area.value = window.location.href;
    copy(area, status);
  });
  body.append(
    element("div", { class: "bar" }, element("label", { for: "copy-what", class: "hidden" }, "What to copy"), what, element("label", { for: "copy-language", class: "hidden" }, "Language"), language, button, link),
    area,
    status,
  );
  what.addEventListener("change", show);
  language.addEventListener("change", show);
  app.on("joints", show);
  show();
}

if (model.frames.length) buildCopy(buildPose());
