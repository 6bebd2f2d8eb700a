// The picture: camera, lights, grid, orbit controls, and drawing on request.
//
// app.three = {THREE, scene, camera, renderer, controls, overlay, requestDraw, draw, fit}; renderer is null where the
// browser has no WebGL. Lengths are those of the robot file; z is up. What other parts draw goes into overlay.

app.size = model.size;
app.stageSize = { width: 1, height: 1 };

const canvas = document.getElementById("canvas");
const stage = document.getElementById("stage");
const scene = new THREE.Scene();
const camera = new THREE.PerspectiveCamera(32, 1, app.size / 100, app.size * 40);
camera.up.set(0, 0, 1);
const ISOMETRIC = new THREE.Vector3(1, -1, 1);
const projected = new THREE.Vector3();
const overlay = new THREE.Group();
const grid = new THREE.Group();
scene.add(grid, overlay);

const sky = new THREE.HemisphereLight("#ffffff", "#8a8f98", 1.9);
sky.position.set(0, 0, 1);
const sun = new THREE.DirectionalLight("#ffffff", 2.2);
sun.position.set(3, -4, 6);
const back = new THREE.DirectionalLight("#ffffff", 0.6);
back.position.set(-4, 3, 1);
scene.add(sky, sun, back);

const renderer = makeRenderer();
const controls = new THREE.OrbitControls(camera, canvas);
controls.rotateSpeed = 0.9;
controls.zoomSpeed = 1.1;
controls.minDistance = app.size / 20;
controls.maxDistance = app.size * 12;
controls.keyPanSpeed = 24;
controls.addEventListener("change", () => requestDraw());

let isWaiting = false;
let isFitted = true;
// What the view was fitted to, whether all of the arm was in it at the last picture, and the arm's present points.
let kept = [];
let sawAll = false;
let points = null;

function makeRenderer() {
  try {
    // The buffer is kept, so that the page prints and pictures can be copied.
    const made = new THREE.WebGLRenderer({ canvas, antialias: true, preserveDrawingBuffer: true });
    made.setPixelRatio(Math.min(window.devicePixelRatio || 1, 2));
    made.outputColorSpace = THREE.SRGBColorSpace;
    return made;
  } catch {
    const notice = document.getElementById("notice");
    notice.textContent = "This browser has no WebGL, so the arm is not drawn; joints and poses work.";
    notice.hidden = false;
    return null;
  }
}

// One picture at the next frame of the screen, however often it is asked for.
function requestDraw() {
  if (isWaiting) return;
  isWaiting = true;
  window.requestAnimationFrame(draw);
}

function draw() {
  isWaiting = false;
  camera.updateMatrixWorld();
  if (!app.isHeld) sawAll = areSeen(armPoints());
  app.emit("draw");
  renderer?.render(scene, camera);
}

function resize() {
  const { clientWidth: width, clientHeight: height } = stage;
  if (!width || !height) return;
  app.stageSize = { width, height };
  camera.aspect = width / height;
  camera.updateProjectionMatrix();
  renderer?.setSize(width, height, false);
  if (isFitted) fit();
  draw();
}

// The whole arm in sight, from the side it is seen from, or from a direction.
function fit(direction = null) {
  kept = armPoints();
  frame(direction ?? camera.position.clone().sub(controls.target));
}

// The camera looks from a direction at all that is kept.
function frame(from) {
  if (from.lengthSq() === 0) from.copy(ISOMETRIC);
  from.normalize();
  const right = new THREE.Vector3().crossVectors(camera.up, from).normalize();
  const up = new THREE.Vector3().crossVectors(from, right);
  const seen = kept.map((each) => [each.dot(right), each.dot(up), each.dot(from)]);
  const view = closest(seen, Math.max(0.075 * app.size, 1.05 * axesLength));
  controls.target.set(0, 0, 0).addScaledVector(right, view.x).addScaledVector(up, view.y).addScaledVector(from, view.z);
  camera.position.copy(controls.target).addScaledVector(from, view.distance);
  isFitted = true;
  controls.update();
  requestDraw();
}

// The view grows when a joint leaves it. Where part of the arm was outside before, somebody looks at a detail; and while
// a handle is dragged the view stays.
function keepInView() {
  if (!sawAll || app.isHeld || areSeen(armPoints())) return;
  const wasFitted = isFitted;
  kept = [...kept, ...armPoints()];
  frame(camera.position.clone().sub(controls.target));
  isFitted = wasFitted;
}

function areSeen(list) {
  camera.updateMatrixWorld();
  return list.every((each) => {
    const { x, y, z } = projected.copy(each).project(camera);
    return z < 1 && Math.abs(x) < 0.97 && Math.abs(y) < 0.97;
  });
}

// Nearer or farther by a factor; the controls keep the distance within its limits.
function zoom(factor) {
  camera.position.sub(controls.target).multiplyScalar(factor).add(controls.target);
  isFitted = false;
  controls.update();
  requestDraw();
}

// Where the camera has to look, and from how far, to see points with a margin; all in the axes of the camera.
function closest(points, margin) {
  const slopes = [camera.aspect, 1].map((ratio) => 0.9 * ratio * Math.tan(THREE.MathUtils.degToRad(camera.fov) / 2));
  const middle = (axis) => (Math.max(...points.map((p) => p[axis])) + Math.min(...points.map((p) => p[axis]))) / 2;
  const [view, z] = [[middle(0), middle(1)], middle(2)];
  let distance = 0;
  for (let round = 0; round < 6; round++) {
    const needed = (p, axis) => p[2] - z + (Math.abs(p[axis] - view[axis]) + margin) / slopes[axis];
    distance = Math.max(app.size, ...points.flatMap((p) => [needed(p, 0), needed(p, 1)]));
    for (const axis of [0, 1]) {
      const seen = points.map((p) => (p[axis] - view[axis]) / (distance - p[2] + z));
      view[axis] += ((Math.max(...seen) + Math.min(...seen)) / 2) * distance;
    }
  }
  return { x: view[0], y: view[1], z, distance };
}

function armPoints() {
  const matrices = () => [identity(), ...app.frames(), ...model.rows.flatMap(app.rowSteps)];
  points ??= matrices().map((m) => new THREE.Vector3(m[3], m[7], m[11])).filter(({ x, y, z }) => Number.isFinite(x + y + z));
  return points;
}

// Lines of the ground; their distance is 1, 2 or 5 times a power of ten of the length unit.
function drawGrid() {
  const colours = app.colours();
  const rough = app.size / 6;
  const power = 10 ** Math.floor(Math.log10(rough));
  const step = power * [5, 2, 1].find((each) => each * power <= rough * 1.0001);
  const count = 2 * Math.ceil((1.15 * app.size) / step);
  const made = new THREE.GridHelper(count * step, count, colours.gridAxis, colours.grid);
  made.rotation.x = Math.PI / 2;
  made.material.transparent = true;
  made.material.opacity = 0.7;
  grid.children.forEach((each) => each.dispose());
  grid.clear();
  grid.add(made);
  app.gridStep = step;
  scene.background = new THREE.Color(colours.background);
}

app.on("theme", drawGrid);
app.on("joints", () => {
  points = null;
  keepInView();
});
// Set while a handle of the arm is dragged.
app.isHeld = false;
app.release = () => {
  app.isHeld = false;
  keepInView();
};
controls.addEventListener("start", () => (isFitted = false));
app.three = { THREE, scene, camera, renderer, controls, overlay, requestDraw, draw, fit };
app.startScene = () => {
  drawGrid();
  fit(ISOMETRIC.clone());
  new ResizeObserver(resize).observe(stage);
  resize();
};
