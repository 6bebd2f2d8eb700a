// Values of trees with names of their own, and what is asked of poses; `numbers.js` has the matrices.
const algebra = (() => {
  const FUNCTIONS = {
    sqrt: Math.sqrt,
    sin: Math.sin,
    cos: Math.cos,
    asin: Math.asin,
    acos: Math.acos,
    atan: Math.atan,
    atan2: Math.atan2,
    abs: Math.abs,
  };

  /**
   * The value of a tree. Its scope has the joint vector q and parameters, those that are set at run time; for a closed
   * form also angles by label, and constants by the names under which they are printed.
   */
  function value(tree, scope) {
    if (!Array.isArray(tree)) {
      return tree;
    }
    const [head, ...parts] = tree;
    switch (head) {
      case "q":
        return scope.q[parts[0]];
      case "p":
        return scope.parameters[parts[0]];
      case "n":
        return scope.constants[parts[0]];
      case "c":
        return Math.cos(scope.angles[parts[0]]);
      case "s":
        return Math.sin(scope.angles[parts[0]]);
      case "+":
        return parts.reduce((sum, part) => sum + value(part, scope), 0);
      case "*":
        return parts.reduce((product, part) => product * value(part, scope), 1);
      case "^":
        return value(parts[0], scope) ** parts[1];
    }
    if (!Object.hasOwn(FUNCTIONS, head)) {
      throw new RangeError(`${head} is not an operation`);
    }
    return FUNCTIONS[head](...parts.map((part) => value(part, scope)));
  }

  /** The joint variables that a tree holds, from 0; those of its angles too. */
  function joints(tree, angles = {}) {
    if (!Array.isArray(tree)) {
      return [];
    }
    if (tree[0] === "q") {
      return [tree[1]];
    }
    if (tree[0] === "c" || tree[0] === "s") {
      return angles[tree[1]] ?? [];
    }
    return [...new Set(tree.slice(1).flatMap((part) => joints(part, angles)))].sort((one, other) => one - other);
  }

  /** The origin of a frame. */
  const origin = (frame) => [frame[3], frame[7], frame[11]];

  /** An axis of a frame, 0 to 2. */
  const axis = (frame, number) => [frame[number], frame[4 + number], frame[8 + number]];

  const dot = (one, other) => one.reduce((sum, entry, place) => sum + entry * other[place], 0);

  const norm = (vector) => Math.hypot(...vector);

  /** The turn that leads from one rotation to another, as a vector in the axes of the base. */
  function turnBetween(from, to) {
    const r = (i, j) => to[4 * i] * from[4 * j] + to[4 * i + 1] * from[4 * j + 1] + to[4 * i + 2] * from[4 * j + 2];
    const twice = [r(2, 1) - r(1, 2), r(0, 2) - r(2, 0), r(1, 0) - r(0, 1)];
    const [sine, cosine] = [norm(twice) / 2, (r(0, 0) + r(1, 1) + r(2, 2) - 1) / 2];
    const angle = Math.atan2(sine, cosine);
    if (sine > 1e-7) {
      return twice.map((entry) => (entry * angle) / (2 * sine));
    }
    if (cosine > 0) {
      return twice.map((entry) => entry / 2);
    }
    // Half a turn: the longest column of R + 1 is along the axis.
    const columns = [0, 1, 2].map((j) => [0, 1, 2].map((i) => r(i, j) + (i === j)));
    const best = columns.reduce((one, other) => (norm(other) > norm(one) ? other : one));
    return best.map((entry) => (entry * angle) / norm(best));
  }

  /** The pose with an origin and with roll, pitch and yaw. */
  function pose(position, [roll, pitch, yaw]) {
    const turns = [elementary("Rz", yaw), elementary("Ry", pitch), elementary("Rx", roll)];
    const found = turns.reduce(multiply);
    position.forEach((entry, row) => (found[4 * row + 3] = entry));
    return found;
  }

  return { value, joints, origin, axis, dot, norm, turnBetween, pose };
})();
