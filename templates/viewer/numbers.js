// Matrices (row by row, 16 numbers), expressions of the robot file, forms of an orientation, and numbers as text.

function identity() {
  return Float64Array.of(1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1);
}

function multiply(a, b) {
  const made = new Float64Array(16);
  for (let row = 0; row < 16; row += 4) {
    for (let column = 0; column < 4; column++) {
      let sum = 0;
      for (let k = 0; k < 4; k++) sum += a[row + k] * b[4 * k + column];
      made[row + column] = sum;
    }
  }
  return made;
}

// An elementary transform such as Rx or Tz.
function elementary(kind, value) {
  const made = identity();
  const axis = "xyz".indexOf(kind[1]);
  if (kind[0] === "T") {
    made[4 * axis + 3] = value;
    return made;
  }
  const [c, s] = [Math.cos(value), Math.sin(value)];
  const [i, j] = [(axis + 1) % 3, (axis + 2) % 3];
  made[5 * i] = made[5 * j] = c;
  made[4 * i + j] = -s;
  made[4 * j + i] = s;
  return made;
}

// The value of an expression (see kinegen/tools/viewer/data.py) at the present joints and parameters.
function valueOf(tree, q = app.state.q) {
  if (typeof tree === "number") return tree;
  const [operation, ...rest] = tree;
  if (operation === "q") return q[rest[0]];
  if (operation === "p") return app.state.parameters[rest[0]];
  if (operation === "^") return valueOf(rest[0], q) ** rest[1];
  const values = rest.map((each) => valueOf(each, q));
  if (operation === "+") return values.reduce((sum, value) => sum + value);
  if (operation === "*") return values.reduce((made, value) => made * value);
  return Math[operation](...values);
}
app.valueOf = valueOf;
app.multiply = multiply;
app.elementary = elementary;

// Quaternion w, x, y, z with w >= 0: the component that is computed by a root is at least a half (Shepperd 1978).
function quaternion(m) {
  const [xx, xy, xz, yx, yy, yz, zx, zy, zz] = [m[0], m[1], m[2], m[4], m[5], m[6], m[8], m[9], m[10]];
  const candidates = [
    [1 + xx + yy + zz, zy - yz, xz - zx, yx - xy],
    [zy - yz, 1 + xx - yy - zz, yx + xy, xz + zx],
    [xz - zx, yx + xy, 1 - xx + yy - zz, zy + yz],
    [yx - xy, xz + zx, zy + yz, 1 - xx - yy + zz],
  ];
  const largest = candidates.reduce((best, each, index) => (each[index] > candidates[best][best] ? index : best), 0);
  const found = candidates[largest];
  const size = Math.hypot(...found);
  const first = found.find((each) => each !== 0);
  const sign = found[0] < 0 || (found[0] === 0 && first < 0) ? -1 : 1;
  return found.map((each) => (sign * each) / size + 0);
}

// The rotation vector: the axis times the angle in 0 to pi.
function rotationVector(m) {
  const [w, x, y, z] = quaternion(m);
  const sine = Math.hypot(x, y, z);
  const factor = sine > 0 ? (2 * Math.atan2(sine, w)) / sine : 2;
  return [x * factor, y * factor, z * factor];
}

// Roll, pitch, yaw with R = Rz(yaw) Ry(pitch) Rx(roll); at pitch = +-90 degrees roll is 0.
function rollPitchYaw(m) {
  const roll = Math.atan2(m[9], m[10]);
  const [s, c] = [Math.sin(roll), Math.cos(roll)];
  const yaw = Math.atan2(s * m[2] - c * m[1], c * m[5] - s * m[6]);
  return [roll, Math.atan2(-m[8], s * m[9] + c * m[10]), yaw];
}

// Phi, theta, psi with R = Rz(phi) Ry(theta) Rz(psi); at theta = 0 and 180 degrees psi is 0.
function eulerZyz(m) {
  const psi = Math.atan2(m[9], 0 - m[8]);
  const [s, c] = [Math.sin(psi), Math.cos(psi)];
  const phi = Math.atan2(s * m[0] + c * m[1] === 0 ? 0 : -(s * m[0] + c * m[1]), s * m[4] + c * m[5]);
  return [phi, Math.atan2(s * m[9] - c * m[8], m[10]), psi];
}
app.orientation = { quaternion, rotationVector, rollPitchYaw, eulerZyz };

const DEGREE = Math.PI / 180;

// Between kernel units and those that are shown; lengths are the same in both.
app.shown = (value, isAngle) => (isAngle && app.state.unit === "deg" ? value / DEGREE : value);
app.taken = (value, isAngle) => (isAngle && app.state.unit === "deg" ? value * DEGREE : value);

// A number as text with so many decimals; no minus sign before a zero.
function decimal(value, digits) {
  if (!Number.isFinite(value)) return String(value);
  if (value !== 0 && (Math.abs(value) >= 1e9 || Math.abs(value) < 10 ** -(digits + 3))) {
    return Math.abs(value) < 1e-12 ? (0).toFixed(digits) : value.toExponential(digits);
  }
  const text = value.toFixed(digits);
  return Number(text) === 0 ? text.replace("-", "") : text;
}
app.decimal = decimal;
