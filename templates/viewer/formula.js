// The closed form with live values: terms light the joints that they hold, and joints the terms.
(() => {
  const form = app.model.formula;
  const body = app.panel("formula", "Closed form", false);
  if (form.missing) {
    body.append(element("p", {}, form.missing));
    return;
  }
  const jointsOf = new Map(form.angles.flatMap(({ label, joints }) => [[`c${label}`, joints], [`s${label}`, joints]]));
  app.model.joints.forEach((_, joint) => jointsOf.set(`q${joint + 1}`, [joint]));
  const runtime = new Map(app.model.parameters.map((each, index) => [each.name, index]));
  const fields = [];

  /** What the trees are evaluated with, at the present joints and parameters. */
  function scope() {
    const found = { q: app.state.q, parameters: app.state.parameters, angles: Object.create(null), constants: Object.create(null) };
    for (const { name, printed, value } of form.parameters) {
      found.constants[printed] = runtime.has(name) ? app.state.parameters[runtime.get(name)] : value;
    }
    for (const { label, value } of form.angles) found.angles[label] = algebra.value(value, found);
    return found;
  }

  /** A place for a value that is kept current. */
  function live(tree, isAngle = false, unit = "") {
    const made = element("output", { class: "live" });
    fields.push((current) => {
      const value = app.shown(algebra.value(tree, current), isAngle);
      made.textContent = `${decimal(value, isAngle && app.state.unit === "deg" ? 2 : 4)}${isAngle ? ` ${app.state.unit}` : unit && ` ${unit}`}`;
    });
    return made;
  }

  function equation(name, pieces, value) {
    return element("div", { class: "equation" }, name, element("span", { class: "terms" }, "= ", ...pieces.flatMap((piece) => [piece, " "])), value);
  }

  function entryName(name) {
    const index = name.slice(1);
    return app.math(["msub", ["mi", name[0]], [/^\d+$/.test(index) ? "mn" : "mi", index]]);
  }

  function factor(each) {
    const lines = [0, 1, 2, 3].flatMap((column) =>
      each.entries.map((row) => {
        const { name, terms, value } = row[column];
        const unit = column === 3 ? app.model.units.length : "";
        return equation(entryName(name), terms.map(app.math), live(value, false, unit));
      }),
    );
    return element("div", { class: "form" }, element("div", { class: "form-name" }, app.math(each.name)), ...lines);
  }

  function product(each) {
    if (each.factors.length === 1) return [factor(each.factors[0])];
    const names = each.factors.map((one) => app.math(one.name));
    return [element("div", { class: "equation" }, app.math(each.name), element("span", { class: "terms" }, "= ", ...names)), ...each.factors.map(factor)];
  }

  /** A term that can be focused, with what it is and its value. */
  function termLine(term, math, pieces, value) {
    const button = element("button", { type: "button", class: "term", "data-term": term, "aria-label": term }, math);
    return equation(button, pieces, value);
  }

  function angleLines({ label, text }) {
    return [["c", "cos"], ["s", "sin"]].map(([head, name]) => {
      const symbol = ["msub", ["mi", head], ["mn", label.replaceAll("_", ",").replaceAll("m", "\u2212")]];
      const argument = ["mrow", ["mi", name], ["mo", "\u2061"], ["mo", "("], text, ["mo", ")"]];
      return termLine(`${head}${label}`, app.math(symbol), [app.math(argument)], live([head, label]));
    });
  }

  function jointLine(joint, index) {
    const math = app.math(["msub", ["mi", "q"], ["mn", String(index + 1)]]);
    return termLine(`q${index + 1}`, math, [joint.name], live(["q", index], joint.angle, app.model.units.length));
  }

  function parameterLine({ printed, text, dimension, unit }) {
    const isAngle = dimension === "angle";
    return equation(app.math(text), [], live(["n", printed], isAngle, isAngle ? "" : unit));
  }

  function section(title, lines) {
    return lines.length ? [element("h3", {}, title), ...lines] : [];
  }

  /** Lights a term, and through its joints the arm; null lets go. */
  function pointAt(term) {
    app.light(term === null ? [] : (jointsOf.get(term) ?? []), term);
  }

  app.on("light", ({ joints, term }) => {
    for (const each of body.querySelectorAll("[data-term]")) {
      const held = jointsOf.get(each.dataset?.term ?? each.getAttribute("data-term")) ?? [];
      const isSame = each.getAttribute("data-term") === term;
      each.classList.toggle("lit", term === null ? joints.some((joint) => held.includes(joint)) : isSame);
    }
  });

  // Scrolling moves terms away from under the mouse; then the one that has the focus counts.
  const termOf = (node) => node?.closest?.("[data-term]")?.getAttribute("data-term") ?? null;
  const termAt = (event) => termOf(event.target) ?? (body.contains(document.activeElement) ? termOf(document.activeElement) : null);
  let pointed = null;
  const follow = (event) => {
    const term = termAt(event);
    if (term !== pointed) pointAt((pointed = term));
  };
  body.addEventListener("pointerover", follow);
  body.addEventListener("focusin", follow);
  for (const event of ["pointerleave", "focusout"]) body.addEventListener(event, () => pointed !== null && pointAt((pointed = null)));

  function refresh() {
    if (!body.parentElement.open) return;
    const current = scope();
    fields.forEach((show) => show(current));
  }

  body.append(
    ...form.products.flatMap(product),
    ...section("Sines and cosines", form.angles.flatMap(angleLines)),
    ...section("Joints", app.model.joints.map(jointLine)),
    ...section("Constants", form.parameters.map(parameterLine)),
  );
  body.parentElement.addEventListener("toggle", refresh);
  app.on("joints", refresh);
  app.on("unit", refresh);

  /** The pose of a tip as the closed form gives it, 16 numbers; tests compare it with the kernel. */
  app.closedForm = (tip = 0) => {
    const current = scope();
    const matrices = form.products[tip].factors.map(({ entries }) => [...entries.flatMap((row) => row.map(({ value }) => algebra.value(value, current))), 0, 0, 0, 1]);
    return matrices.reduce(multiply);
  };
})();
