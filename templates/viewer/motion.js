// How the end effector moves: its path, the points that it reaches, its velocity ellipsoids, and singular poses.
(() => {
  const T = app.three.THREE;
  if (!subject.dof) return;
  const body = app.panel("motion", "Motion", false);
  const MOST = 4000;
  const NEAR = 0.1;

  /** A toggle with its state. */
  function option(text, title, change) {
    const made = app.toggle(text, title, false, () => {
      change();
      app.three.requestDraw();
    });
    return { button: made, isOn: () => made.getAttribute("aria-pressed") === "true" };
  }

  // Trace ------------------------------------------------------------------------------------------------------------

  const trace = (() => {
    const points = new Float32Array(3 * MOST);
    const geometry = new T.BufferGeometry();
    const attribute = new T.BufferAttribute(points, 3);
    geometry.setAttribute("position", attribute);
    const material = new T.LineBasicMaterial({ color: app.colours().trace, transparent: true, depthTest: false });
    const path = new T.Line(geometry, material);
    path.frustumCulled = false;
    path.renderOrder = 8;
    app.three.overlay.add(path);
    let count = 0;
    const show = () => {
      geometry.setDrawRange(0, count);
      path.visible = count > 0;
      attribute.needsUpdate = true;
      clear.disabled = count === 0;
    };
    const toggle = option("Trace", "Draw the path of the end effector", () => toggle.isOn() && add());
    const clear = app.button("Clear trace", "Remove the path so far", () => {
      count = 0;
      if (toggle.isOn()) add();
      show();
      app.three.requestDraw();
    });

    /** The present tip, unless it has not moved; the oldest half goes when there is no more room. */
    function add() {
      const at = algebra.origin(subject.pose(app.state.q));
      const last = Array.from(points.subarray(3 * (count - 1), 3 * count));
      if (count && algebra.norm(at.map((entry, i) => entry - last[i])) < 1e-4 * app.size) return;
      if (count === MOST) {
        points.copyWithin(0, (3 * MOST) / 2);
        count = MOST / 2;
      }
      points.set(at, 3 * count++);
      show();
    }

    app.on("theme", () => material.color.set(app.colours().trace));
    show();
    return { toggle, clear, add, count: () => count };
  })();

  // Reachable points -------------------------------------------------------------------------------------------------

  const cloud = (() => {
    const data = app.model.cloud;
    if (!data) return null;
    const material = new T.PointsMaterial({ size: 2, sizeAttenuation: false, transparent: true, opacity: 0.5, depthWrite: false, color: app.colours().accent });
    let points = null;
    const toggle = option("Reachable points", `${data.count} positions of ${data.tip} within the limits`, async () => {
      points ??= await load();
      points.visible = toggle.isOn();
      app.three.requestDraw();
    });

    async function load() {
      const geometry = new T.BufferGeometry();
      geometry.setAttribute("position", new T.BufferAttribute(await unpacked(data), 3));
      const made = new T.Points(geometry, material);
      app.three.overlay.add(made);
      return made;
    }

    app.on("theme", () => material.color.set(app.colours().accent));
    return { toggle, count: () => points?.geometry.attributes.position.count ?? 0 };
  })();

  // Ellipsoids -------------------------------------------------------------------------------------------------------

  const bodies = ["accent", "y"].map((colour) => {
    const mesh = new T.Mesh(new T.SphereGeometry(1, 32, 20), shapes.paint(colour, 0.28, false));
    mesh.matrixAutoUpdate = false;
    mesh.renderOrder = 6;
    mesh.visible = false;
    app.three.overlay.add(mesh);
    return mesh;
  });
  const texts = ["velocity", "rotation"].map(() => element("dd"));
  const options = [
    option("Velocity ellipsoid", "Velocities of the end effector at joint rates of norm 1", refresh),
    option("Angular-velocity ellipsoid", "Angular velocities of the end effector at joint rates of norm 1", refresh),
  ];

  /** Semi-axes, drawn so that the longest has a third of the size of the arm at most. */
  function drawEllipsoid(number, rows, at) {
    const mesh = bodies[number];
    const axes = spectrum.ellipsoid(rows);
    mesh.visible = options[number].isOn();
    const unit = number ? "rad/s" : `${app.model.units.length}/s`;
    texts[number].textContent = axes.map(({ length }) => decimal(length, 4)).join("  ") + ` ${unit}`;
    if (!mesh.visible) return;
    const factor = (0.22 * app.size) / Math.max(number ? 1.5 : app.size, axes[0].length, 1e-300);
    const [x, y, z] = axes.map(({ length, vector }) => new T.Vector3(...vector).multiplyScalar(Math.max(length * factor, 0.004 * app.size)));
    if (x.clone().cross(y).dot(z) < 0) z.negate();
    mesh.matrix.makeBasis(x, y, z).setPosition(...at);
    mesh.matrixWorldNeedsUpdate = true;
  }

  // Singular poses ---------------------------------------------------------------------------------------------------

  const warning = element("p", { id: "singular", class: "note", role: "status" });
  const layer = shapes.layer(12);

  function showSingular(rows, at) {
    const { share, joints } = spectrum.nearness(rows, subject);
    layer.clear();
    const isSingular = share < 1e-6;
    warning.classList.toggle("warning", share < NEAR);
    if (share >= NEAR) {
      warning.textContent = `Not near a singularity: the smallest singular value is ${decimal(100 * share, 0)} % of its typical value.`;
      return;
    }
    layer.name(isSingular ? "singular" : "nearly singular", at, "warning");
    const parts = joints.map(({ joint, part }) => `${subject.names[joint]} ${part < 0 ? "\u2212" : "+"}${decimal(Math.abs(part), 2)}`);
    const move = !joints.length ? "some joints move" : joints.length === 1 ? `joint ${subject.names[joints[0].joint]} moves` : `the joints move together (${parts.join(", ")})`;
    const steps = app.model.joints.map((joint) => (joint.type === "prismatic" ? app.size : 1));
    const near = spectrum.near(app.model.singular[subject.tip], Array.from(app.state.q), steps);
    const words = near.map((place) => ` ${place.words[0].toUpperCase()}${place.words.slice(1)}.`).join("");
    warning.textContent = isSingular
      ? `Singular: ${move} and the end effector does not.${words}`
      : `Nearly singular (${decimal(100 * share, 1)} % of the typical smallest singular value): ${move} and the end effector hardly does.${words}`;
  }

  // All of it --------------------------------------------------------------------------------------------------------

  function refresh() {
    const isOpen = body.parentElement.open;
    if (!isOpen && !options.some((each) => each.isOn())) {
      layer.clear();
      return;
    }
    const at = algebra.origin(subject.pose(app.state.q));
    const flat = subject.jacobian(app.state.q);
    const rows = Array.from({ length: 6 }, (_, row) => Array.from(flat.subarray(row * subject.dof, (row + 1) * subject.dof)));
    drawEllipsoid(0, rows.slice(0, 3), at);
    drawEllipsoid(1, rows.slice(3), at);
    showSingular(solve.scaled(subject, app.state.q, 6), at);
    app.three.requestDraw();
  }

  body.append(
    element("div", { class: "bar" }, trace.toggle.button, trace.clear, ...(cloud ? [cloud.toggle.button] : [])),
    element("div", { class: "bar" }, ...options.map((each) => each.button)),
    element("dl", { class: "forms" }, element("dt", {}, "Velocity ellipsoid, semi-axes"), texts[0], element("dt", {}, "Angular-velocity ellipsoid, semi-axes"), texts[1]),
    warning,
  );
  body.parentElement.addEventListener("toggle", refresh);
  app.on("joints", () => {
    if (trace.toggle.isOn()) trace.add();
    refresh();
  });
  app.on("tip", () => {
    trace.clear.click();
    refresh();
  });
  app.motion = { traced: trace.count, clouded: () => cloud?.count() ?? 0 };
})();
