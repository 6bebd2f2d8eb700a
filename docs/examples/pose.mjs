import { DOF, LIMITS, fk, fk_batch, inverse } from "../../build/web/puma560/javascript/puma560.js";

// One configuration: angles in rad, a 4x4 matrix row by row.
const T = fk([0, -0.3, 0.6, 0, 0.4, 0]);
console.log("position", [3, 7, 11].map((place) => T[place].toFixed(4)).join(" "));

// The same without new arrays, as a loop that draws wants it.
const q = new Float64Array(DOF);
q[1] = -0.3;
fk(q, T);

// Many configurations at once.
const poses = fk_batch(new Float64Array(1000 * DOF));
console.log("poses", poses.length / 16);

// All joint vectors of a pose.
const [solutions, valid] = inverse(T);
console.log("solutions", valid.reduce((sum, one) => sum + one), "of", valid.length);
console.log("first", Array.from(solutions.subarray(0, DOF), (angle) => angle.toFixed(3)).join(" "));
console.log("limits of joint 1", LIMITS[0]);
