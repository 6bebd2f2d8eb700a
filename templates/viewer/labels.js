// The axes of every frame, and their names beside them.

const labels = document.getElementById("labels");
const axesLength = Math.min(0.1 * app.size, 6.5 * thickness);
const axesMaterial = new THREE.MeshBasicMaterial({ vertexColors: true, depthTest: false, transparent: true });
const named = [{ name: model.rootLabel, matrix: identity }];
if (model.base.length) named.push({ name: "0", matrix: () => product(model.base) });
model.frames.forEach((frame, index) => named.push({ name: frame.name, matrix: () => app.frames()[index] }));

// Three arrows along x, y and z as one form, whose colours are those of its points.
function arrows() {
  const [shaft, head] = [new THREE.CylinderGeometry(0.014, 0.014, 0.82, 10), new THREE.ConeGeometry(0.05, 0.2, 14)];
  shaft.rotateX(Math.PI / 2).translate(0, 0, 0.41);
  head.rotateX(Math.PI / 2).translate(0, 0, 0.9);
  const points = [];
  const sizes = [];
  for (const axis of ["x", "y", "z"]) {
    const turned = [shaft, head].map((form) => form.clone().applyMatrix4(TO_AXIS[axis]).toNonIndexed());
    const made = turned.flatMap((form) => Array.from(form.getAttribute("position").array));
    points.push(...made);
    sizes.push(made.length / 3);
  }
  const form = new THREE.BufferGeometry();
  form.setAttribute("position", new THREE.Float32BufferAttribute(points, 3));
  form.setAttribute("color", new THREE.Float32BufferAttribute(new Float32Array(points.length), 3));
  return { form, sizes };
}

const { form: arrowForm, sizes: arrowSizes } = arrows();
const triads = new THREE.InstancedMesh(arrowForm, axesMaterial, named.length);
triads.frustumCulled = false;
triads.renderOrder = 10;
scene.add(triads);

for (const each of named) {
  each.label = element("span", { class: "label" }, each.name);
  labels.append(each.label);
}

function colourTriads() {
  const colours = app.colours();
  const numbers = ["x", "y", "z"].flatMap((axis, index) => {
    const { r, g, b } = new THREE.Color(colours[axis]);
    return Array.from({ length: arrowSizes[index] }, () => [r, g, b]).flat();
  });
  arrowForm.getAttribute("color").set(numbers).needsUpdate = true;
}

app.showFrames = (wanted) => {
  triads.visible = wanted;
  requestDraw();
};
app.showLabels = (wanted) => {
  labels.hidden = !wanted;
  requestDraw();
};

const point = new THREE.Vector3();
const HEIGHT = 17;
// Where a name may be beside its origin, the best place first: right or left of it (1, 0), and how far below.
const PLACES = [0, 1, -1, 2, -2].flatMap((row) => [[1, row], [0, row]]);

// Names beside their origins, within the picture; a name for which there is no room is left out until there is.
function placeLabels() {
  const { width, height } = app.stageSize;
  const taken = [];
  for (const each of named) {
    const m = each.matrix();
    point.set(m[3], m[7], m[11]).project(camera);
    const isSeen = point.z < 1 && Math.abs(point.x) < 1 && Math.abs(point.y) < 1;
    const place = isSeen ? freePlace((0.5 + point.x / 2) * width, (0.5 - point.y / 2) * height, each, taken, width) : null;
    each.label.hidden = !place;
    if (!place) continue;
    taken.push(place);
    each.label.style.transform = `translate(${place.x.toFixed(1)}px, ${place.y.toFixed(1)}px)`;
  }
}

function freePlace(x, y, { name }, taken, width) {
  const size = 7.2 * name.length + 10;
  for (const [right, row] of PLACES) {
    const place = { x: right ? x + 8 : x - 8 - size, y: y + 5 + row * HEIGHT, size };
    const covers = (other) =>
      Math.abs(other.y - place.y) < HEIGHT && place.x < other.x + other.size && other.x < place.x + size;
    const isWithin = place.x >= 0 && place.x + size <= width;
    if (isWithin && !taken.some(covers)) return place;
  }
  return null;
}

colourTriads();
app.on("theme", colourTriads);
app.on("draw", () => {
  named.forEach((each, index) => {
    triads.setMatrixAt(index, at(each.matrix(), "z", axesLength, axesLength, axesLength));
  });
  triads.instanceMatrix.needsUpdate = true;
  if (!labels.hidden) placeLabels();
});
