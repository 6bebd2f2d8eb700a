// Runtime parameters as number fields; the arm changes its shape with them.

function buildParameters() {
  if (!model.parameters.length) return;
  const body = app.panel("parameters", "Parameters");
  const fields = model.parameters.map((each, index) => {
    const id = `parameter-${index}`;
    const isAngle = each.dimension === "angle";
    const field = element("input", { type: "number", step: "any", id, autocomplete: "off" });
    const unit = element("span", { class: "unit" });
    field.addEventListener("input", () => {
      if (!Number.isFinite(field.valueAsNumber)) return;
      const parameters = app.state.parameters.slice();
      parameters[index] = app.taken(field.valueAsNumber, isAngle);
      app.setParameters(parameters, "parameters");
    });
    const show = () => {
      if (document.activeElement !== field) field.value = String(Number(app.shown(app.state.parameters[index], isAngle).toPrecision(12)));
      unit.textContent = isAngle ? app.state.unit : each.unit;
    };
    field.addEventListener("blur", show);
    return { show, element: element("div", { class: "field" }, element("label", { for: id }, each.name), field, unit) };
  });
  const show = () => fields.forEach((each) => each.show());
  const reset = app.button("Values of the file", "Every parameter as the robot file has it", () =>
    app.setParameters(model.parameters.map((each) => each.value), "reset"),
  );
  body.append(...fields.map((each) => each.element), element("div", { class: "bar" }, reset));
  app.on("parameters", show);
  app.on("unit", show);
  show();
}

buildParameters();
