// Actuator coordinates: joints follow them, and where the file leads back they follow the joints.

// What a slider of an actuator goes between.
function boundsOf({ dimension, range: [low, high] }) {
  const reach = dimension === "angle" ? Math.PI : dimension === "length" ? app.size : 100;
  return [low ?? -reach, high ?? reach];
}

function buildActuators() {
  if (!model.actuators.length || !app.kernels.actuators_to_joints) return;
  const body = app.panel("actuators", "Actuators");
  const hasBack = Boolean(app.kernels.joints_to_actuators);
  const readings = Float64Array.from(model.actuators, (each) => each.home);
  const note = element("p", { class: "note", role: "status" });

  const items = model.actuators.map((each) => {
    const [low, high] = boundsOf(each);
    return { key: "actuator", name: each.name, isAngle: each.dimension === "angle", unit: each.unit, low, high, isLimited: !each.range.includes(null) };
  });
  const made = sliders(items, (index) => readings[index], (index, value) => {
    readings[index] = value;
    const joints = app.evaluate("actuators_to_joints", readings);
    const isPossible = app.setJoints(joints, "actuators");
    note.textContent = isPossible ? "" : "The linkage does not close at these actuator coordinates.";
    made.show();
  });
  const follow = ({ origin } = {}) => {
    if (origin === "actuators") return;
    if (hasBack) {
      const found = app.evaluate("joints_to_actuators", app.state.q);
      const isPossible = found.every(Number.isFinite);
      if (isPossible) readings.set(found);
      note.textContent = isPossible ? "" : "No actuator coordinates lead to these joints; the last ones are shown.";
    } else {
      note.textContent = "The file has no way from joints back to actuators, so these keep their values.";
    }
    made.show();
  };
  body.append(made.element, note);
  app.on("joints", follow);
  app.on("unit", made.show);
  follow();
}

buildActuators();
