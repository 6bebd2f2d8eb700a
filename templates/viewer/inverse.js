// The inverse: the end effector is dragged or its pose typed, and the arm follows; all branches of a closed form are drawn.
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
  let target = null;
  let found = [];
  let hovered = -1;

  // Controls ---------------------------------------------------------------------------------------------------------

  const drag = makeControls();
  const dragToggle = app.toggle("Move TCP", "Show handles that move the end effector", false, showHandles);
  const turn = app.toggle("Rotate TCP", "The handles rotate the end effector instead of moving it", false, (wanted) => drag?.setMode(wanted ? "rotate" : "translate"));
  const ghostToggle = hasForm ? app.toggle("All solutions", "Draw all solutions of the closed form", true, refresh) : null;
  const aim = element("select", { id: "inverse-aim" }, element("option", { value: "pose" }, "position and orientation"), element("option", { value: "position" }, "position"));
  const tips = element("select", { id: "inverse-tip" }, ...subject.tips.map((name, index) => element("option", { value: index }, name)));
  const fields = ["x", "y", "z", "roll", "pitch", "yaw"].map(field);
  const list = element("ol", { id: "branches", class: "branches" });

  function field(name, index) {
    const isAngle = index > 2;
    const input = element("input", { type: "number", step: "any", id: `target-${name}`, autocomplete: "off" });
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
    return { name, show, read, input, element: element("div", { class: "coordinate" }, element("label", { for: input.id }, name), input, unit) };
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
      if (value) app.isHeld = true;
      else {
        settle();
        app.release();
      }
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

  /** The arm follows a target: by the nearest branch of the closed form, else by a search. */
  function follow(wanted, isDragged) {
    target = wanted;
    const present = app.state.q.slice();
    found = hasForm ? solve.branches(subject, target, present) : [];
    const best = aim.value === "pose" || !subject.readsAttitude ? solve.nearest(subject, found, present) : undefined;
    if (best && isDragged && best.change > JUMP) {
      say(`The nearest solution moves a joint by ${angleText(best.change)}; the arm waits. Select a solution to continue.`, true);
    } else if (best) {
      app.setJoints(best.q, "inverse");
      say(`Reached: ${best.name}.`);
    } else {
      search(present);
    }
    refresh();
  }

  function search(present) {
    const made = solve.approach(subject, present, target, aim.value === "pose" && subject.readsAttitude);
    const positionOnly = aim.value === "position" || !subject.readsAttitude;
    app.setJoints(made.q, "inverse");
    if (positionOnly || !made.reached) found = hasForm ? solve.branches(subject, subject.pose(made.q), app.state.q) : [];
    if (made.reached) {
      say(hasForm && !positionOnly ? "Reached by a numeric search." : "Reached.");
      return;
    }
    const { length, angle } = made;
    const isAt = length <= 1e-6 * subject.reach;
    const gaps = [isAt ? "" : `${Number(length.toPrecision(4))} ${app.model.units.length}`, positionOnly || angle < 1e-6 ? "" : angleText(angle)].filter(Boolean);
    say(`${isAt ? "This orientation is out of reach" : "Out of reach"}: the end effector is ${gaps.join(" and ")} away from the target.`, true);
  }

  const angleText = (angle) => (app.state.unit === "deg" ? `${shortNumber(app.shown(angle, true), 1)} deg` : `${shortNumber(angle, 3)} rad`);

  function say(text, isWarning = false) {
    status.textContent = text;
    status.classList.toggle("warning", isWarning);
  }

  /** After a drag the handles go back to the tip if it is there; else the target stays until something else moves. */
  function settle() {
    if (target && isThere()) target = null;
    refresh();
  }

  const isThere = () => {
    const { length, turn: angle } = solve.away(subject.pose(app.state.q), target);
    return length <= 1e-6 * subject.reach && algebra.norm(angle) <= 1e-6;
  };

  function typed() {
    const numbers = fields.map((each) => each.read());
    if (!numbers.every(Number.isFinite)) {
      say("A field is not a number.", true);
      return;
    }
    const wanted = Array.from(algebra.pose(numbers.slice(0, 3), numbers.slice(3)));
    placeHandle(wanted);
    follow(wanted, false);
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

  const isCurrent = (each) => each.valid && each.q.every((value, i) => Math.abs(value - app.state.q[i]) <= 1e-6 * subject.units[i]);

  function drawGhosts() {
    const isOn = hasForm && body.parentElement.open && ghostToggle.getAttribute("aria-pressed") === "true";
    ghostGroup.visible = isOn;
    if (!isOn) return;
    found.forEach((each, index) => {
      const group = ghostGroup.children[index];
      group.visible = (each.valid || each.drawable) && !isCurrent(each);
      if (!group.visible) return;
      const isLit = hovered === index;
      const material = shapes.paint(isLit ? "highlight" : each.valid ? "ghost" : "x", isLit ? 0.8 : each.valid ? 0.34 : 0.14, false);
      ghosts[index](story.path(table, { q: each.q, parameters: app.state.parameters }), material);
    });
  }

  /** The list of branches: which are solutions, which is the current one, and why others are not. */
  function listBranches() {
    found.forEach((each, index) => {
      const item = list.children[index] ?? branchItem(index);
      const button = item.firstElementChild;
      button.disabled = !each.valid;
      const isShown = isCurrent(each);
      button.setAttribute("aria-pressed", String(isShown));
      item.lastElementChild.textContent = isShown ? "current" : each.valid ? "valid" : each.reason;
      item.className = each.valid ? "valid" : "invalid";
    });
  }

  /** The name of a branch with line breaks behind commas alone. */
  function unbroken(name) {
    const words = name.split(", ");
    return words.flatMap((word, place) => [element("span", {}, place + 1 < words.length ? `${word},` : word), " "]).slice(0, -1);
  }

  function branchItem(index) {
    const button = element("button", { type: "button", "aria-pressed": "false" }, ...unbroken(subject.branches[index]));
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
    say(`Selected: ${found[index].name}.`);
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
    if (!target || isThere()) return;
    const [from, to] = [algebra.origin(subject.pose(app.state.q)), algebra.origin(target)];
    const paint = shapes.paint("x");
    line.rod(from, to, paint, 1.2 * shapes.width);
    line.ball(to, 4 * shapes.width, paint);
    line.axes(target, 0.07 * app.size, 0.8 * shapes.width);
    line.name("target", to, "warning");
  }

  function refresh() {
    const isOpen = body.parentElement.open;
    if (!isOpen && !target && !drag?.enabled) {
      [line.group.visible, ghostGroup.visible] = [false, false];
      return;
    }
    line.group.visible = true;
    const pose = target ?? subject.pose(app.state.q);
    if (!target && hasForm && isOpen) found = solve.branches(subject, pose, app.state.q);
    drawLine();
    drawGhosts();
    if (!target && drag?.enabled && !drag.dragging) placeHandle(pose);
    app.three.requestDraw();
    if (!isOpen) return;
    if (hasForm) listBranches();
    const numbers = [...algebra.origin(pose), ...rollPitchYaw(pose)];
    fields.forEach((each, index) => each.show(numbers[index]));
  }

  function moved({ origin } = {}) {
    if (origin === "inverse") return;
    target = null;
    say("");
    refresh();
  }

  function build() {
    const bar = element("div", { class: "bar" }, dragToggle, turn, ...(ghostToggle ? [ghostToggle] : []));
    const choices = [];
    if (subject.tips.length > 1) choices.push(element("div", { class: "choose" }, element("label", { for: "inverse-tip" }, "End effector"), tips));
    if (subject.readsAttitude) choices.push(element("div", { class: "choose" }, element("label", { for: "inverse-aim" }, "Target"), aim));
    const about = hasForm ? `Closed form: ${app.model.inverse.family}.` : "No closed form: a numeric search (damped least squares) follows the target.";
    body.append(element("p", { class: "note" }, about), bar, ...choices, element("div", { class: "coordinates" }, ...fields.map((each) => each.element)), status);
    if (hasForm) body.append(list, ...conditions());
    tips.addEventListener("change", () => (subject.tip = Number(tips.value)));
    aim.addEventListener("change", () => follow(target ?? Array.from(subject.pose(app.state.q)), false));
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
