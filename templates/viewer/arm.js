// The arm as solids, made from the frames: links as tubes along the elementary transforms of the rows, a housing for
// each moving joint, and a tool at each tip.

const arm = new THREE.Group();
scene.add(arm);
const parts = [];
const materials = {};
const thickness = tubeRadius();
const UNIT_TUBE = new THREE.CylinderGeometry(1, 1, 1, 24, 1, true).rotateX(Math.PI / 2).translate(0, 0, 0.5);
const UNIT_BALL = new THREE.SphereGeometry(1, 24, 16);
const UNIT_DRUM = new THREE.CylinderGeometry(1, 1, 1, 40).rotateX(Math.PI / 2);
const UNIT_RING = new THREE.CylinderGeometry(1, 1, 1, 40, 1, true).rotateX(Math.PI / 2);
const UNIT_BOX = new THREE.BoxGeometry(1, 1, 1);
// Turns the z axis to the x, y or z axis.
const TO_AXIS = {
  x: new THREE.Matrix4().makeRotationY(Math.PI / 2),
  y: new THREE.Matrix4().makeRotationX(-Math.PI / 2),
  z: new THREE.Matrix4(),
};

// A radius that suits the lengths that the arm is made of.
function tubeRadius() {
  const lengths = [];
  for (const row of model.rows) {
    for (const step of row.steps) {
      const length = step.kind[0] === "T" ? Math.abs(valueOf(step.value)) : 0;
      if (length > 1e-3 * app.size) lengths.push(length);
    }
  }
  lengths.sort((a, b) => a - b);
  const middle = lengths.length ? lengths[lengths.length >> 1] : app.size;
  return Math.min(Math.max(0.085 * middle, 0.008 * app.size), 0.021 * app.size);
}

function material(name) {
  materials[name] ??= new THREE.MeshStandardMaterial({ roughness: 0.55, metalness: 0.08 });
  return materials[name];
}

// A solid; place(put, ways) says where it is. Solids of one form and colour are drawn together.
function add(geometry, name, place) {
  parts.push({ geometry, name, place });
}

// From our matrices, which lie row by row.
app.matrix4 = (m, target = new THREE.Matrix4()) => target.set(...m);

const placed = new THREE.Matrix4();
const scaled = new THREE.Matrix4();
const HIDDEN = new THREE.Matrix4().makeScale(0, 0, 0);

// The form along an axis of a frame, with its size.
function at(m, axis, x, y, z) {
  return app.matrix4(m, placed).multiply(TO_AXIS[axis]).multiply(scaled.makeScale(x, y, z));
}

// One mesh for all solids of a form and a colour.
function buildMeshes() {
  const groups = new Map();
  for (const part of parts) {
    const key = `${part.geometry.uuid} ${part.name}`;
    if (!groups.has(key)) groups.set(key, []);
    groups.get(key).push(part);
  }
  for (const members of groups.values()) {
    const mesh = new THREE.InstancedMesh(members[0].geometry, material(members[0].name), members.length);
    mesh.frustumCulled = false;
    arm.add(mesh);
    members.forEach((part, index) => Object.assign(part, { mesh, index }));
  }
}

// The index of the elementary transform that the joint of a row moves, or -1.
app.movingStep = (row) => row.steps.findIndex((step) => row.joints.length && mentions(step.value));

function mentions(tree) {
  return Array.isArray(tree) && (tree[0] === "q" || tree.slice(1).some(mentions));
}

function buildRow(row, index) {
  const moving = app.movingStep(row);
  row.steps.forEach((step, number) => {
    if (step.kind[0] === "T" && step.value !== 0) addShift(row, index, number, number === moving);
  });
  if (moving >= 0) addJoint(row, index, moving);
}

// A tube along a shift, with a ball at its end; what slides is thinner.
function addShift(row, index, number, slides) {
  const axis = row.steps[number].kind[1];
  const radius = thickness * (slides ? 0.62 : 1);
  const colour = slides ? "slide" : "link";
  add(UNIT_TUBE, colour, (ways) => tube(ways[index][number], axis, radius, valueOf(row.steps[number].value)));
  add(UNIT_BALL, colour, (ways) => at(ways[index][number + 1], "z", radius, radius, radius));
}

function tube(m, axis, radius, length) {
  return Math.abs(length) > 1e-6 * app.size ? at(m, axis, radius, radius, length) : HIDDEN;
}

// A drum about the axis of a revolute joint, a box about that of a prismatic one.
function addJoint(row, index, number) {
  const step = row.steps[number];
  const axis = step.kind[1];
  const colour = row.joint === null ? "link" : "joint";
  if (step.kind[0] === "T") {
    // Behind the frame, so that what slides comes out of it.
    const behind = elementary(step.kind, -1.8 * thickness);
    const [wide, long] = [2.8 * thickness, 3.6 * thickness];
    add(UNIT_BOX, colour, (ways) => at(multiply(ways[index][number], behind), axis, wide, wide, long));
    return;
  }
  const { radius, height, shift } = housings.get(row.name);
  const aside = elementary(`T${axis}`, shift);
  const ring = 1.02 * radius;
  const place = (ways) => multiply(ways[index][number], aside);
  add(UNIT_DRUM, colour, (ways) => at(place(ways), axis, radius, radius, height));
  add(UNIT_RING, "accent", (ways) => at(place(ways), axis, ring, ring, 0.14 * height));
}

// The base, a plate under the first frame, and tubes along the fixed transforms of base, tool and named frames.
function buildFixed() {
  const [wide, low] = [3.6 * thickness, 0.7 * thickness];
  const under = elementary("Tz", -low / 2);
  add(UNIT_DRUM, "base", () => at(under, "z", wide, wide, low));
  buildPath(model.base, identity);
  for (const frame of model.frames) {
    if (frame.steps) buildPath(frame.steps, () => app.frame(frame.parent));
  }
}

function buildPath(steps, start) {
  const radius = 0.7 * thickness;
  steps.forEach((step, number) => {
    if (step.kind[0] !== "T" || step.value === 0) return;
    const after = (count) => product(steps.slice(0, count), start());
    add(UNIT_TUBE, "link", () => tube(after(number), step.kind[1], radius, valueOf(step.value)));
    add(UNIT_BALL, "link", () => at(after(number + 1), "z", radius, radius, radius));
  });
}

// At each tip a disc, and for a chain the two fingers of a gripper, in the direction in which the last link leads.
function buildTools() {
  for (const tip of model.tips) {
    const { axis, sign } = approach(tip);
    const size = 2.2 * thickness;
    const off = model.tree ? 0 : clearOf(tip, axis, sign);
    const ahead = (along, aside) =>
      multiply(multiply(app.frame(tip), elementary(`T${axis}`, sign * (off + along))), elementary(axis === "x" ? "Ty" : "Tx", aside));
    add(UNIT_DRUM, "tool", () => at(ahead(0.1 * size, 0), axis, 0.62 * size, 0.62 * size, 0.3 * size));
    if (model.tree) continue;
    const [x, y] = axis === "x" ? [0.4 * size, 0.22 * size] : [0.22 * size, 0.4 * size];
    for (const side of [-0.38, 0.38]) {
      add(UNIT_BOX, "tool", () => at(ahead(0.7 * size, side * size), axis, x, y, size));
    }
  }
}

// How far ahead of a tip a gripper is clear of the drums there.
function clearOf(tip, axis, sign) {
  const m = app.frame(tip);
  const [from, way] = [new THREE.Vector3(m[3], m[7], m[11]), column(m, "xyz".indexOf(axis)).multiplyScalar(sign)];
  const ends = Array.from(housings.values(), (each) => {
    const gap = each.at.clone().addScaledVector(each.axis, each.shift).sub(from);
    const along = Math.abs(each.axis.dot(way));
    const reach = 0.5 * along * each.height + Math.sqrt(Math.max(0, 1 - along * along)) * each.radius;
    return gap.length() < each.radius + each.height ? gap.dot(way) + reach : 0;
  });
  return Math.max(0, ...ends);
}

// The axis of a tip along which the last link leads, and to which side; z where a joint turns that link off its axis.
function approach(tip) {
  const frame = model.frames.find((each) => each.name === tip);
  const last = model.rows.find((row) => row.name === (frame.kind === "row" ? tip : frame.parent)) ?? model.rows.at(-1);
  const steps = [...(last?.steps ?? []), ...(frame.steps ?? [])];
  const shift = steps.findLastIndex((step) => step.kind[0] === "T" && step.value !== 0);
  if (shift < 0) return { axis: "z", sign: 1 };
  const [kind, after] = [steps[shift].kind[1], steps.slice(shift + 1)];
  if (after.some((step) => step.kind[1] !== kind && mentions(step.value))) return { axis: "z", sign: 1 };
  // A row of the matrix of the steps behind the shift is its axis as the tip has it.
  const way = product(after).slice(4 * "xyz".indexOf(kind), 4 * "xyz".indexOf(kind) + 3);
  const most = way.reduce((best, part, index) => (Math.abs(part) > Math.abs(way[best]) + 1e-9 ? index : best), 0);
  return { axis: "xyz"[most], sign: Math.sign(way[most]) * (valueOf(steps[shift].value) < 0 ? -1 : 1) };
}

function colourArm() {
  const colours = app.colours();
  for (const name of Object.keys(materials)) materials[name].color.set(colours[name]);
}

app.setXray = (wanted) => {
  for (const each of Object.values(materials)) {
    each.transparent = wanted;
    each.opacity = wanted ? 0.35 : 1;
    each.depthWrite = !wanted;
    each.needsUpdate = true;
  }
  requestDraw();
};

const housings = findHousings();
buildFixed();
model.rows.forEach(buildRow);
buildTools();
buildMeshes();
colourArm();
app.on("theme", colourArm);

let isStale = true;
app.on("joints", () => (isStale = true));
app.on("draw", () => {
  if (!isStale) return;
  isStale = false;
  const ways = model.rows.map(app.rowSteps);
  for (const { mesh, index, place } of parts) mesh.setMatrixAt(index, place(ways));
  for (const mesh of arm.children) mesh.instanceMatrix.needsUpdate = true;
});
