// What the panels draw beside the arm: rods, arcs, arrows, axes and names, in front of everything.
//
// A layer is a group of the scene with its own names; what it holds is drawn anew by clear() and the functions below.
const shapes = (() => {
  const { THREE: T, overlay, requestDraw } = app.three;
  const ROD = new T.CylinderGeometry(1, 1, 1, 16).rotateX(Math.PI / 2).translate(0, 0, 0.5);
  const CONE = new T.ConeGeometry(1, 1, 20).rotateX(Math.PI / 2).translate(0, 0, 0.5);
  const BALL = new T.SphereGeometry(1, 20, 14);
  const RING = new T.TorusGeometry(1, 0.07, 12, 48);
  const SHARED = new Set([ROD, CONE, BALL, RING]);
  const WIDTH = Math.min(0.0024 * app.size, 0.16 * thickness);
  const marks = element("div", { id: "marks", "aria-hidden": "true" });
  document.getElementById("stage").append(marks);
  const names = [];
  const corner = new T.Vector3();
  const made = new Map();

  /** A material by colour, as the present theme has it, and opacity; in front of the arm or within the scene. */
  function paint(colour, opacity = 1, isFront = true) {
    const key = `${colour} ${opacity} ${isFront}`;
    if (!made.has(key)) {
      const options = { transparent: true, opacity, depthTest: !isFront, depthWrite: false };
      made.set(key, { colour, material: new T.MeshBasicMaterial({ ...options, color: app.colours()[colour] }) });
    }
    return made.get(key).material;
  }

  app.on("theme", () => {
    for (const { colour, material } of made.values()) material.color.set(app.colours()[colour]);
  });

  function layer(order = 20) {
    const group = new T.Group();
    overlay.add(group);
    const own = [];

    function add(geometry, material) {
      const mesh = new T.Mesh(geometry, material);
      mesh.renderOrder = order;
      group.add(mesh);
      return mesh;
    }

    function clear() {
      for (const mesh of group.children) if (!SHARED.has(mesh.geometry)) mesh.geometry.dispose();
      group.clear();
      for (const each of own.splice(0)) {
        each.mark.remove();
        names.splice(names.indexOf(each), 1);
      }
      requestDraw();
    }

    return {
      group,
      clear,
      rod: (from, to, material, width = WIDTH) => along(add(ROD, material), from, to, width),
      ball: (at, radius, material) => scaled(add(BALL, material), at, radius),
      arrow: (from, to, material, width = WIDTH) => arrow(add, from, to, material, width),
      arc: (points, material, width = WIDTH) => add(tube(points, width), material),
      ring: (matrix, radius, material) => {
        const mesh = add(RING, material);
        mesh.matrixAutoUpdate = false;
        app.matrix4(matrix, mesh.matrix).multiply(new T.Matrix4().makeScale(radius, radius, radius));
        return mesh;
      },
      axes: (matrix, length, width = 1.6 * WIDTH) => {
        const at = algebra.origin(matrix);
        ["x", "y", "z"].forEach((name, number) => {
          const end = algebra.axis(matrix, number).map((entry, i) => at[i] + length * entry);
          arrow(add, at, end, paint(name), width);
        });
      },
      name: (text, at, kind = "") => {
        const each = { mark: element("span", { class: `label ${kind}` }, text), at };
        own.push(each);
        names.push(each);
        marks.append(each.mark);
        return each;
      },
    };
  }

  /** Puts a rod between two points. */
  function along(mesh, from, to, width) {
    const way = to.map((entry, i) => entry - from[i]);
    const length = algebra.norm(way);
    mesh.visible = length > 1e-7 * app.size;
    mesh.position.set(...from);
    if (mesh.visible) mesh.quaternion.setFromUnitVectors(new T.Vector3(0, 0, 1), corner.set(...way).divideScalar(length));
    mesh.scale.set(width, width, length);
    return mesh;
  }

  function scaled(mesh, at, radius) {
    mesh.position.set(...at);
    mesh.scale.setScalar(radius);
    return mesh;
  }

  function arrow(add, from, to, material, width) {
    const way = to.map((entry, i) => entry - from[i]);
    const length = algebra.norm(way);
    const head = Math.min(8 * width, 0.45 * length);
    const neck = to.map((entry, i) => entry - (way[i] * head) / (length || 1));
    along(add(ROD, material), from, neck, width);
    along(add(CONE, material), neck, to, 2.6 * width);
  }

  /** A tube of six sides along points; three.js would need a curve. */
  function tube(points, width) {
    const [positions, faces] = [[], []];
    points.forEach((each, place) => {
      const [before, after] = [points[Math.max(0, place - 1)], points[Math.min(points.length - 1, place + 1)]];
      const way = new T.Vector3(...after).sub(new T.Vector3(...before)).normalize();
      const side = Math.abs(way.z) < 0.9 ? new T.Vector3(0, 0, 1) : new T.Vector3(1, 0, 0);
      const one = side.cross(way).normalize();
      const other = way.clone().cross(one);
      for (let k = 0; k < 6; k++) {
        const [c, s] = [Math.cos((k * Math.PI) / 3) * width, Math.sin((k * Math.PI) / 3) * width];
        positions.push(each[0] + c * one.x + s * other.x, each[1] + c * one.y + s * other.y, each[2] + c * one.z + s * other.z);
        if (place) {
          const [a, b] = [6 * place + k, 6 * place + ((k + 1) % 6)];
          faces.push(a, b, a - 6, b, b - 6, a - 6);
        }
      }
    });
    const geometry = new T.BufferGeometry();
    geometry.setAttribute("position", new T.Float32BufferAttribute(positions, 3));
    geometry.setIndex(faces);
    return geometry;
  }

  /** Names at their points; those that would cover each other are put one below the other. */
  function placeNames() {
    if (!names.length) return;
    const { clientWidth: width, clientHeight: height } = marks;
    const taken = [];
    for (const { mark, at } of names) {
      corner.set(...at).project(app.three.camera);
      mark.hidden = corner.z >= 1 || Math.abs(corner.x) > 1 || Math.abs(corner.y) > 1;
      if (mark.hidden) continue;
      const x = (0.5 + corner.x / 2) * width + 10;
      let y = (0.5 - corner.y / 2) * height - 22;
      const size = 7.4 * mark.textContent.length + 12;
      while (taken.some((other) => Math.abs(other.y - y) < 19 && x < other.x + other.size && other.x < x + size)) y -= 3;
      taken.push({ x, y, size });
      mark.style.transform = `translate(${x.toFixed(1)}px, ${y.toFixed(1)}px)`;
    }
  }

  app.on("draw", placeNames);
  return { layer, paint, along, width: WIDTH };
})();

/** An element of MathML from a nested list (see kinegen/tools/viewer/closed_form_json.py); text is text, never markup. */
app.math = (() => {
  const SPACE = "http://www.w3.org/1998/Math/MathML";
  const TAGS = new Set("math mrow mi mn mo mtext msub msup mfrac msqrt mspace mmultiscripts mprescripts none".split(" "));

  function made(list) {
    if (typeof list === "string") return document.createTextNode(list);
    const [tag, ...rest] = list;
    const isTerm = tag === "term";
    if (!isTerm && !TAGS.has(tag)) throw new RangeError(`${tag} is not an element of a formula`);
    const found = document.createElementNS(SPACE, isTerm ? "mrow" : tag);
    if (isTerm) found.setAttribute("data-term", rest.shift());
    // Brackets that grow around an index make lines of very different heights.
    if (tag === "mo" && /^[()]$/.test(rest[0])) found.setAttribute("stretchy", "false");
    found.append(...rest.map(made));
    return found;
  }

  return (list) => made(["math", list]);
})();
