// The drum of each revolute joint: its radius and height, and how far along its axis from the joint's frame it is.
//
// A joint turns about a line, so its drum may be anywhere on that line. Drums whose axes cross close to each other are
// moved apart, onto a link that runs along one of the axes; where none does, the outer one is fat and the inner one long.
function findHousings() {
  const found = new Map();
  const rows = new Map(model.rows.map((row) => [row.name, row]));
  model.rows.forEach((row) => {
    const number = app.movingStep(row);
    if (number < 0 || row.steps[number].kind[0] === "T") return;
    const m = app.rowSteps(row)[number];
    let above = rows.get(row.parent);
    while (above && !found.has(above.name)) above = rows.get(above.parent);
    const parent = above ? found.get(above.name) : null;
    const place = new THREE.Vector3(m[3], m[7], m[11]);
    found.set(row.name, { at: place, axis: column(m, "xyz".indexOf(row.steps[number].kind[1])), parent, nested: 0, shift: 0 });
  });
  const drums = [...found.values()];
  const tips = model.tips.map(app.frame).map((m) => new THREE.Vector3(m[3], m[7], m[11]));
  for (const each of drums) {
    const next = drums.filter((other) => other.parent === each).map((other) => other.at);
    if (!next.length) next.push(nearestOf(tips, each.at));
    each.before = each.at.clone().sub(each.parent?.at ?? new THREE.Vector3());
    each.after = next[0].clone().sub(each.at);
    each.links = [each.before, ...next.map((at) => at.clone().sub(each.at))].map((link) => link.length());
  }
  for (const each of drums) {
    // Joints that share a point share its shortest link.
    const here = drums.filter((other) => other.at.distanceTo(each.at) < 1.2 * thickness);
    const shortest = Math.min(...here.flatMap((other) => other.links).filter((length) => length > 1.2 * thickness));
    each.radius = Math.max(1.15 * thickness, Math.min(1.6 * thickness, 0.38 * shortest));
    each.height = 2.7 * each.radius;
  }
  drums.forEach(moveApart);
  app.housings = found;
  return found;
}

// One of two drums with crossing axes gives way along its own axis if the link there is long enough for it.
function moveApart(drum) {
  const { parent } = drum;
  if (!parent || Math.abs(drum.axis.dot(parent.axis)) > 0.9) return;
  const [one, other] = [parent, drum].map((each) => each.at.clone().addScaledVector(each.axis, each.shift));
  if (one.distanceTo(other) > 1.3 * (drum.radius + parent.radius)) return;
  const back = parent.shift === 0 && giveWay(parent, drum, parent.before, -1);
  if (back || giveWay(drum, parent, drum.after, 1)) return;
  drum.nested = parent.nested + 1;
  drum.radius = Math.max(thickness, 0.78 * parent.radius);
  drum.height = 1.3 * parent.height;
}

function giveWay(drum, other, link, side) {
  const along = link.dot(drum.axis);
  const height = 1.5 * drum.radius;
  if (Math.abs(along) < other.radius + height) return false;
  drum.shift = side * Math.sign(along) * (1.04 * other.radius + 0.5 * height);
  drum.height = height;
  return true;
}

function column(m, index) {
  return new THREE.Vector3(m[index], m[4 + index], m[8 + index]);
}

function nearestOf(points, to) {
  return points.reduce((one, other) => (other.distanceTo(to) < one.distanceTo(to) ? other : one), points[0] ?? to);
}
