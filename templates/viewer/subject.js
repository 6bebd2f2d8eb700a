// The arm that the panels ask: kernels, limits and sizes of one tip, in the form in which solve.js takes them.
const subject = (() => {
  const { inverse } = app.model;
  let tip = 0;
  let usual = null;
  const size = app.model.tips.length;
  const part = (numbers, length) => numbers.subarray(tip * length, (tip + 1) * length);

  const found = {
    dof: app.model.joints.length,
    names: app.model.joints.map((joint) => joint.name),
    limits: app.model.joints.map((joint) => joint.limits),
    branches: app.kernels.inverse ? inverse.branches : [],
    periods: inverse.periods.map((each) => each ?? Infinity),
    units: inverse.units,
    reach: inverse.reach,
    readsAttitude: inverse.readsAttitude,
    pose: (q) => part(app.evaluate("fk", q), 16),
    jacobian: (q) => part(app.evaluate("jacobian", q), 6 * app.model.joints.length),
    inverse: (target) => app.evaluate("inverse", Float64Array.from(target)),
    tips: app.model.tips,
    get tip() {
      return tip;
    },
    set tip(wanted) {
      tip = Math.min(Math.max(0, wanted), size - 1);
      usual = null;
      app.emit("tip", tip);
    },
    /** The rank that the Jacobian usually has. */
    get rank() {
      return (usual ??= sampled()).rank;
    },
    /** The usual size of its smallest singular value. */
    get typical() {
      return (usual ??= sampled()).typical;
    },
  };

  function sampled() {
    return spectrum.usual((q) => solve.scaled(found, q, 6), inverse.box);
  }

  app.on("parameters", () => (usual = null));
  return found;
})();

/** Lights joints, in the picture and in the list of joints; a term of the closed form may be named as the reason. */
app.light = (joints, term = null) => app.emit("light", { joints, term });

(() => {
  const layer = shapes.layer(30);
  const rows = Array.from(document.querySelectorAll("#joints .slider"));
  let lit = [];

  rows.forEach((row, joint) => {
    const on = () => app.light([joint]);
    const off = () => app.light([]);
    for (const event of ["pointerenter", "focusin"]) row.addEventListener(event, on);
    for (const event of ["pointerleave", "focusout"]) row.addEventListener(event, off);
  });

  /** A ring about each axis that turns, an arrow along each that shifts; followers move too. */
  function draw() {
    layer.clear();
    for (const joint of lit) {
      for (const row of app.model.rows.filter((each) => each.joints.includes(joint))) {
        const moving = app.movingStep(row);
        if (moving < 0) continue;
        const step = row.steps[moving];
        const matrix = app.rowSteps(row)[moving];
        const about = algebra.axis(matrix, "xyz".indexOf(step.kind[1]));
        const at = algebra.origin(matrix);
        const reach = 0.075 * app.size;
        const end = (sign) => at.map((entry, i) => entry + sign * reach * about[i]);
        const paint = shapes.paint("highlight");
        layer.arrow(end(-1), end(1.25), paint);
        if (step.kind[0] === "R") layer.ring(multiply(matrix, facing(step.kind[1])), 0.055 * app.size, paint);
        layer.name(app.model.joints[joint].name, end(1.25), "lit");
      }
    }
    app.three.requestDraw();
  }

  const facing = (axis) => (axis === "z" ? identity() : elementary(axis === "x" ? "Ry" : "Rx", Math.PI / 2));

  app.on("light", ({ joints }) => {
    lit = joints;
    rows.forEach((row, joint) => row.classList.toggle("lit", joints.includes(joint)));
    draw();
  });
  app.on("joints", () => lit.length && draw());
  app.on("theme", () => lit.length && draw());
})();
