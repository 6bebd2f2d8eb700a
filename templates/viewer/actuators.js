// The readings of actuators: joints follow them, and where the file leads back they follow the joints.

function buildActuators() {
  if (!model.actuators.length || !app.kernels.actuators_to_joints) return;
  const body = app.panel("actuators", "Actuators");
  const hasBack = Boolean(app.kernels.joints_to_actuators);
  const readings = Float64Array.from(model.actuators, middleOf);
  const note = element("p", { class: "note", role: "status" });

  const items = model.actuators.map((each) => {
    const isAngle = each.dimension === "angle";
    const reach = isAngle ? Math.PI : each.dimension === "length" ? app.size : 100;
    const [low, high] = each.range;
    return { key: "actuator", name: each.name, isAngle, unit: each.unit, low: low ?? -reach, high: high ?? reach, isLimited: low !== null && high !== null };
  });
  const made = sliders(items, (index) => readings[index], (index, value) => {
    readings[index] = value;
    const joints = app.evaluate("actuators_to_joints", readings);
    const isPossible = app.setJoints(joints, "actuators");
    note.textContent = isPossible ? "" : "The linkage cannot take these readings: it does not close.";
    made.show();
  });
  const follow = ({ origin } = {}) => {
    if (origin === "actuators") return;
    if (hasBack) {
      const found = app.evaluate("joints_to_actuators", app.state.q);
      const isPossible = found.every(Number.isFinite);
      if (isPossible) readings.set(found);
      note.textContent = isPossible ? "" : "No readings lead to these joints; the last ones are shown.";
    } else {
      note.textContent = "The file does not lead from joints back to readings, so these stay where they are.";
    }
    made.show();
  };
  body.append(made.element, note);
  app.on("joints", follow);
  app.on("unit", made.show);
  follow();
}

buildActuators();
