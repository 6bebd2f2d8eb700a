// The inverse: the tip is dragged or its pose typed, and the arm follows; all branches of a closed form are drawn.
(() => {
  const T = app.three.THREE;
  if (!subject.dof) return;
  const hasForm = subject.branches.length > 0;
  const JUMP = Math.PI / 3;
  const body = app.panel("inverse", "Inverse", false);
  const line = shapes.layer(25);
  const ghostGroup = new T.Group();
  app.three.overlay.add(ghostGroup);
  const table = app.model.tables.tables[0];
  const handle = new T.Object3D();
  app.three.scene.add(handle);
  const status = element("p", { class: "note", role: "status", id: "inverse-status" });
  let wish = null;
  let found = [];
  let hovered = -1;

  // Controls ---------------------------------------------------------------------------------------------------------

  const drag = makeControls();
  const dragToggle = app.toggle("Drag the tip", "Show handles at the tip that can be dragged", false, showHandles);
  const turn = app.toggle("Turn", "Handles turn the tip instead of shifting it", false, (wanted) => drag?.setMode(wanted ? "rotate" : "translate"));
  const ghostToggle = hasForm ? app.toggle("All solutions", "Draw every branch of the closed form", true, refresh) : null;
  const aim = element("select", { id: "inverse-aim" }, element("option", { value: "pose" }, "position and orientation"), element("option", { value: "position" }, "position"));
  const tips = element("select", { id: "inverse-tip" }, ...subject.tips.map((name, index) => element("option", { value: index }, name)));
  const fields = ["x", "y", "z", "roll", "pitch", "yaw"].map(field);
  const list = element("ol", { id: "branches", class: "branches" });

  function field(name, index) {
    const isAngle = index > 2;
    const input = element("input", { type: "number", step: "any", id: `wish-${name}`, autocomplete: "off" });
    const unit = element("span", { class: "unit" });
    input.addEventListener("change", typed);
    let exact = 0;
    let text = "";
    const show = (value) => {
      unit.textContent = isAngle ? app.state.unit : app.model.units.length;
      exact = value;
      text = shortNumber(app.shown(value, isAngle), isAngle ? 3 : 5);
      if (document.activeElement !== input) input.value = text;
    };
    // What nobody has changed keeps the digits that are not shown.
    const read = () => (input.value === text ? exact : app.taken(input.valueAsNumber, isAngle));
    return { name, show, read, input, element: element("div", { class: "wish" }, element("label", { for: input.id }, name), input, unit) };
  }

  /** The handles; a browser without WebGL has none, and the fields work all the same. */
  function makeControls() {
    if (!app.three.renderer) return null;
    const made = new T.TransformControls(app.three.camera, app.three.renderer.domElement);
    made.setSize(0.85);
    made.attach(handle);
    made.enabled = false;
    made.addEventListener("change", () => app.three.requestDraw());
    made.addEventListener("dragging-changed", ({ value }) => {
      app.three.controls.enabled = !value;
      if (!value) settle();
    });
    made.addEventListener("objectChange", () => {
      handle.updateMatrix();
      follow(rowMajor(handle.matrix), true);
    });
    return made;
  }

  const rowMajor = (matrix) => matrix.clone().transpose().toArray();

  function showHandles(wanted) {
    if (!drag) return;
    drag.enabled = wanted;
    // Handles compute their places for every picture, also where they are invisible.
    if (wanted) app.three.scene.add(drag.getHelper());
    else app.three.scene.remove(drag.getHelper());
    if (wanted) placeHandle(subject.pose(app.state.q));
    app.three.requestDraw();
  }

  function placeHandle(pose) {
    app.matrix4(pose, handle.matrix).decompose(handle.position, handle.quaternion, handle.scale);
    handle.updateMatrixWorld();
  }

  // Solving ----------------------------------------------------------------------------------------------------------

  /** The arm follows a wish: by the nearest branch of the closed form, else by a search. */
  function follow(target, isDragged) {
    wish = target;
    const present = app.state.q.slice();
    found = hasForm ? solve.branches(subject, wish, present) : [];
    const best = aim.value === "pose" || !subject.readsAttitude ? solve.nearest(subject, found, present) : undefined;
    if (best && isDragged && best.change > JUMP) {
      say(`The nearest solution moves a joint by ${angleText(best.change)}; the arm waits. Choose a solution to take it.`, true);
    } else if (best) {
      app.setJoints(best.q, "inverse");
      say(`Reached: ${best.name}.`);
    } else {
      search(present);
    }
    refresh();
  }

  function search(present) {
    const made = solve.approach(subject, present, wish, aim.value === "pose" && subject.readsAttitude);
    const positionOnly = aim.value === "position" || !subject.readsAttitude;
    app.setJoints(made.q, "inverse");
    if (positionOnly || !made.reached) found = hasForm ? solve.branches(subject, subject.pose(made.q), app.state.q) : [];
    if (made.reached) {
      say(hasForm && !positionOnly ? "Reached by a search." : "Reached.");
      return;
    }
    const { length, angle } = made;
    const isAt = length <= 1e-6 * subject.reach;
    const gaps = [isAt ? "" : `${Number(length.toPrecision(4))} ${app.model.units.length}`, positionOnly || angle < 1e-6 ? "" : angleText(angle)].filter(Boolean);
    say(`${isAt ? "This orientation is not reached" : "Out of reach"}: the tip is ${gaps.join(" and ")} away.`, true);
  }

  const angleText = (angle) => (app.state.unit === "deg" ? `${shortNumber(app.shown(angle, true), 1)} deg` : `${shortNumber(angle, 3)} rad`);

  function say(text, isWarning = false) {
    status.textContent = text;
    status.classList.toggle("warning", isWarning);
  }

  /** After a drag the handles go back to the tip if it is there; else the wish stays until something else moves. */
  function settle() {
    if (wish && isThere()) wish = null;
    refresh();
  }

  const isThere = () => {
    const { length, turn: angle } = solve.away(subject.pose(app.state.q), wish);
    return length <= 1e-6 * subject.reach && algebra.norm(angle) <= 1e-6;
  };

  function typed() {
    const numbers = fields.map((each) => each.read());
    if (!numbers.every(Number.isFinite)) {
      say("A field has no number.", true);
      return;
    }
    const target = Array.from(algebra.pose(numbers.slice(0, 3), numbers.slice(3)));
    placeHandle(target);
    follow(target, false);
  }

  // Branches ---------------------------------------------------------------------------------------------------------

  const ghosts = subject.branches.map((_, index) => ghost(index));

  /** A thin arm of its own for each branch; its parts are moved, never made anew. */
  function ghost(index) {
    const group = new T.Group();
    group.userData.branch = index;
    const parts = [];
    ghostGroup.add(group);
    const layer = shapes.layer(5);
    group.add(layer.group);
    return (paths, material) => {
      let used = 0;
      for (const points of paths) {
        for (let place = 1; place < points.length; place++) {
          if (algebra.norm(points[place].map((entry, i) => entry - points[place - 1][i])) < 1e-6 * app.size) continue;
          parts[used] ??= [layer.rod([0, 0, 0], [0, 0, 1], material), layer.ball([0, 0, 0], 1, material)];
          const [rod, ball] = parts[used++];
          shapes.along(rod, points[place - 1], points[place], 0.62 * thickness);
          ball.position.set(...points[place]);
          ball.scale.setScalar(0.62 * thickness);
          rod.material = ball.material = material;
        }
      }
      parts.flat().forEach((mesh, number) => {
        mesh.userData.branch = index;
        mesh.visible = number < 2 * used;
      });
    };
  }

  const isTaken = (each) => each.valid && each.q.every((value, i) => Math.abs(value - app.state.q[i]) <= 1e-6 * subject.units[i]);

  function drawGhosts() {
    const isOn = hasForm && body.parentElement.open && ghostToggle.getAttribute("aria-pressed") === "true";
    ghostGroup.visible = isOn;
    if (!isOn) return;
    found.forEach((each, index) => {
      const group = ghostGroup.children[index];
      group.visible = (each.valid || each.drawable) && !isTaken(each);
      if (!group.visible) return;
      const isLit = hovered === index;
      const material = shapes.paint(isLit ? "highlight" : each.valid ? "ghost" : "x", isLit ? 0.8 : each.valid ? 0.34 : 0.14, false);
      ghosts[index](story.path(table, { q: each.q, parameters: app.state.parameters }), material);
    });
  }

  /** The list of branches: which are solutions, which is taken, and why others are not. */
  function listBranches() {
    found.forEach((each, index) => {
      const item = list.children[index] ?? branchItem(index);
      const button = item.firstElementChild;
      button.disabled = !each.valid;
      const taken = isTaken(each);
      button.setAttribute("aria-pressed", String(taken));
      item.lastElementChild.textContent = taken ? "taken" : each.valid ? "valid" : each.reason;
      item.className = each.valid ? "valid" : "invalid";
    });
  }

  function branchItem(index) {
    const button = element("button", { type: "button", "aria-pressed": "false" }, subject.branches[index]);
    const item = element("li", {}, button, element("span", { class: "note" }));
    button.addEventListener("click", () => take(index));
    const hover = (wanted) => () => {
      hovered = wanted;
      drawGhosts();
      app.three.requestDraw();
    };
    for (const event of ["pointerenter", "focusin"]) item.addEventListener(event, hover(index));
    for (const event of ["pointerleave", "focusout"]) item.addEventListener(event, hover(-1));
    list.append(item);
    return item;
  }

  function take(index) {
    if (!found[index]?.valid) return;
    app.setJoints(found[index].q, "inverse");
    say(`Taken: ${found[index].name}.`);
    refresh();
  }

  /** A click on a ghost takes its branch; a drag turns the view. */
  function clickable() {
    const { renderer, camera, controls } = app.three;
    if (!renderer || !hasForm) return;
    const canvas = renderer.domElement;
    const caster = new T.Raycaster();
    let start = null;
    canvas.addEventListener("pointerdown", (event) => (start = [event.clientX, event.clientY]));
    canvas.addEventListener("pointerup", (event) => {
      if (!ghostGroup.visible || !start || !controls.enabled) return;
      if (Math.hypot(event.clientX - start[0], event.clientY - start[1]) > 4) return;
      const box = canvas.getBoundingClientRect();
      const at = new T.Vector2(((event.clientX - box.left) / box.width) * 2 - 1, 1 - ((event.clientY - box.top) / box.height) * 2);
      caster.setFromCamera(at, camera);
      const seen = ghostGroup.children.filter((each) => each.visible);
      const hit = caster.intersectObjects(seen, true).find((each) => each.object.visible);
      if (hit) take(hit.object.userData.branch);
    });
  }

  // The picture ------------------------------------------------------------------------------------------------------

  function drawLine() {
    line.clear();
    if (!wish || isThere()) return;
    const [from, to] = [algebra.origin(subject.pose(app.state.q)), algebra.origin(wish)];
    const paint = shapes.paint("x");
    line.rod(from, to, paint, 1.2 * shapes.width);
    line.ball(to, 4 * shapes.width, paint);
    line.axes(wish, 0.07 * app.size, 0.8 * shapes.width);
    line.name("wish", to, "warning");
  }

  function refresh() {
    const isOpen = body.parentElement.open;
    if (!isOpen && !wish && !drag?.enabled) {
      [line.group.visible, ghostGroup.visible] = [false, false];
      return;
    }
    line.group.visible = true;
    const pose = wish ?? subject.pose(app.state.q);
    if (!wish && hasForm && isOpen) found = solve.branches(subject, pose, app.state.q);
    drawLine();
    drawGhosts();
    if (!wish && drag?.enabled && !drag.dragging) placeHandle(pose);
    app.three.requestDraw();
    if (!isOpen) return;
    if (hasForm) listBranches();
    const numbers = [...algebra.origin(pose), ...rollPitchYaw(pose)];
    fields.forEach((each, index) => each.show(numbers[index]));
  }

  function moved({ origin } = {}) {
    if (origin === "inverse") return;
    wish = null;
    say("");
    refresh();
  }

  function build() {
    const bar = element("div", { class: "bar" }, dragToggle, turn, ...(ghostToggle ? [ghostToggle] : []));
    const choices = [];
    if (subject.tips.length > 1) choices.push(element("div", { class: "choose" }, element("label", { for: "inverse-tip" }, "Tip"), tips));
    if (subject.readsAttitude) choices.push(element("div", { class: "choose" }, element("label", { for: "inverse-aim" }, "Follow"), aim));
    const about = hasForm ? `Closed form: ${app.model.inverse.family}.` : "No closed form: a search (damped least squares) follows the tip.";
    body.append(element("p", { class: "note" }, about), bar, ...choices, element("div", { class: "wishes" }, ...fields.map((each) => each.element)), status);
    if (hasForm) body.append(list, ...conditions());
    tips.addEventListener("change", () => (subject.tip = Number(tips.value)));
    aim.addEventListener("change", () => follow(wish ?? Array.from(subject.pose(app.state.q)), false));
    body.parentElement.addEventListener("toggle", refresh);
    if (!drag) dragToggle.disabled = turn.disabled = true;
  }

  function conditions() {
    const texts = [...app.model.inverse.meanings, ...app.model.inverse.conditions];
    return [element("ul", { class: "note" }, ...texts.map((text) => element("li", {}, text)))];
  }

  build();
  clickable();
  app.on("joints", moved);
  app.on("tip", () => moved());
  app.on("unit", refresh);
  app.follow = follow;
})();
