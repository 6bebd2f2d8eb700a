// The kernels of this page against test vectors, which were computed with 50 digits.
//
// A vector passes if every kernel gives each of its numbers within its tolerance. The inverse has targets of its own: one
// of its valid solutions must be the joint vector that the target comes from.

function checkVectors() {
  const { inputs, kernels: list } = model.checks;
  const count = Math.max(...Object.values(inputs).map((rows) => rows.length), 0);
  const wrong = new Set();
  const names = new Set();
  for (const kernel of list) {
    const rows = Math.min(...kernel.results.map((result) => result.rows.length));
    for (let index = 0; index < rows; index++) {
      if (kernelIsRight(kernel, inputs, index)) continue;
      wrong.add(index);
      names.add(kernel.name);
    }
  }
  return { count, right: count - wrong.size, names };
}

function kernelIsRight(kernel, inputs, index) {
  const given = kernel.inputs.map((name) => lengthened(name, inputs[name][index]));
  const returned = defaultCall(kernel.name, given);
  const found = kernel.results.length > 1 ? returned : [returned];
  return kernel.results.every((result, place) => {
    const wanted = result.rows[index];
    const numbers = result.pose ? withoutLastRows(found[place]) : Array.from(found[place]);
    return numbers.length === wanted.length && wanted.every((value, entry) => isNear(numbers[entry], value, result, entry));
  });
}

// A kernel with the parameters of the file, whatever the fields show.
function defaultCall(name, given) {
  return app.kernels[name](...given.map((each) => Float64Array.from(each)));
}

// Poses among inputs come without their last rows.
function lengthened(name, row) {
  return row.length === 12 && name.includes("_T_") ? [...row, 0, 0, 0, 1] : row;
}

function withoutLastRows(numbers) {
  return Array.from(numbers).filter((_, index) => index % 16 < 12);
}

function isNear(found, wanted, result, entry) {
  const turns = result.turns ? 2 * Math.PI * Math.round((found - wanted) / (2 * Math.PI)) : 0;
  return Math.abs(found - wanted - turns) <= result.accepted[entry];
}

function checkTargets() {
  const { targets, tolerances } = model.checks;
  const right = targets.filter(({ pose, q }) => {
    const [solutions, valid] = defaultCall("inverse", [[...pose.slice(0, 12), 0, 0, 0, 1]]);
    const isSolution = (branch) => q.every((value, joint) => {
      const difference = solutions[branch * q.length + joint] - value;
      const turns = model.joints[joint].angle ? 2 * Math.PI * Math.round(difference / (2 * Math.PI)) : 0;
      return Math.abs(difference - turns) <= tolerances[joint];
    });
    return Array.from(valid).some((isValid, branch) => isValid && isSolution(branch));
  });
  return { count: targets.length, right: right.length };
}

function showBadge() {
  const badge = document.getElementById("badge");
  let text, isRight, title;
  try {
    const [vectors, targets] = [checkVectors(), checkTargets()];
    isRight = vectors.right === vectors.count && targets.right === targets.count;
    text = `${vectors.right}/${vectors.count} test poses`;
    title = `The kernels of this page agree with ${vectors.right} of ${vectors.count} test vectors, which were computed with 50 digits`;
    if (targets.count) title += `; the inverse finds ${targets.right} of ${targets.count} targets`;
    if (vectors.names.size) title += `; wrong: ${[...vectors.names].join(", ")}`;
  } catch (error) {
    [text, isRight, title] = ["check failed", false, `A kernel of this page does not run: ${error.message}`];
  }
  badge.className = isRight ? "right" : "wrong";
  badge.textContent = isRight ? `✓ verified: ${text}` : `✗ not verified: ${text}`;
  badge.title = title;
  badge.append(element("span", { class: "hidden" }, `: ${title}`));
  app.checked = { isRight, text };
}

showBadge();
