// From a target to joints: which solution of a closed form is followed, and a search where there is none.
const solve = (() => {
  const SMALL = 1e-10;

  /** How far a pose is from a target: metres (or what the file has) and radians. */
  function away(pose, target) {
    const gap = algebra.origin(target).map((entry, i) => entry - algebra.origin(pose)[i]);
    return { gap, turn: algebra.turnBetween(pose, target), length: algebra.norm(gap) };
  }

  /** A joint value by whole turns as near to another as limits allow. */
  function nearTurn(value, near, period, limits) {
    if (!Number.isFinite(period)) {
      return value;
    }
    const [low, high] = limits ?? [-Infinity, Infinity];
    const wanted = Math.round((near - value) / period);
    // Towards the value itself, which is within its limits, one turn after the other.
    for (let turns = wanted; turns !== 0; turns -= Math.sign(turns)) {
      const moved = value + turns * period;
      if (moved >= low && moved <= high) {
        return moved;
      }
    }
    return value;
  }

  /** Every branch of a closed form for a target: joints, whether it is valid, and why not. */
  function branches(arm, target, present) {
    const [solutions, valid] = arm.inverse(target);
    const { dof } = arm;
    return arm.branches.map((name, place) => {
      const found = Array.from(solutions.slice(place * dof, (place + 1) * dof));
      if (valid[place]) {
        const q = found.map((value, i) => nearTurn(value, present[i], arm.periods[i], arm.limits[i]));
        return { name, q, valid: true, reason: "" };
      }
      return { name, q: found, valid: false, ...outside(arm, found, target) };
    });
  }

  /** Why a branch is not valid; one that leads there all the same is only outside its limits. */
  function outside(arm, q, target) {
    const leads = q.every(Number.isFinite) && isThere(arm, away(arm.pose(q), target));
    const over = arm.limits.map((each, i) => each && (q[i] < each[0] - SMALL || q[i] > each[1] + SMALL));
    const names = arm.names.filter((_, i) => over[i]);
    return leads && names.length
      ? { drawable: true, reason: `outside the limits of ${names.join(", ")}` }
      : { drawable: false, reason: "out of reach" };
  }

  function isThere(arm, { length, turn }) {
    return length <= 1e-6 * arm.reach && (!arm.readsAttitude || algebra.norm(turn) <= 1e-6);
  }

  /** The valid branch nearest to some joints, with the largest change of a joint; undefined if there is none. */
  function nearest(arm, found, present) {
    const changes = (each) => each.q.map((value, i) => Math.abs(value - present[i]) / arm.units[i]);
    return found
      .map((each, place) => ({ ...each, place, change: Math.max(...changes(each)), sum: algebra.norm(changes(each)) }))
      .filter((each) => each.valid)
      .sort((one, other) => one.sum - other.sum)[0];
  }

  /** Solves a x = b for a symmetric, positive definite a of n rows (Cholesky); changes both. */
  function cholesky(a, b, n) {
    for (let j = 0; j < n; j++) {
      for (let k = 0; k < j; k++) {
        for (let i = j; i < n; i++) {
          a[i * n + j] -= a[i * n + k] * a[j * n + k];
        }
      }
      const pivot = Math.sqrt(a[j * n + j]);
      for (let i = j; i < n; i++) {
        a[i * n + j] /= pivot;
      }
    }
    for (let i = 0; i < n; i++) {
      for (let k = 0; k < i; k++) {
        b[i] -= a[i * n + k] * b[k];
      }
      b[i] /= a[i * n + i];
    }
    for (let i = n - 1; i >= 0; i--) {
      for (let k = i + 1; k < n; k++) {
        b[i] -= a[k * n + i] * b[k];
      }
      b[i] /= a[i * n + i];
    }
    return b;
  }

  /** A damped step towards a target, in units of the joints; joints that are not free stay. */
  function step(rows, error, free, damping) {
    const [m, n] = [rows.length, free.length];
    const square = new Float64Array(m * m);
    for (let i = 0; i < m; i++) {
      for (let j = 0; j < m; j++) {
        for (let k = 0; k < n; k++) {
          square[i * m + j] += free[k] ? rows[i][k] * rows[j][k] : 0;
        }
      }
      square[i * m + i] += damping;
    }
    const weights = cholesky(square, Float64Array.from(error), m);
    return free.map((isFree, k) => (isFree ? rows.reduce((sum, row, i) => sum + row[k] * weights[i], 0) : 0));
  }

  /** The Jacobian without units: lengths as shares of the reach, each column for a unit of its joint. */
  function scaled(arm, q, rowCount) {
    const flat = arm.jacobian(q);
    return Array.from({ length: rowCount }, (_, row) =>
      arm.units.map((unit, k) => (flat[row * arm.dof + k] * unit) / (row < 3 ? arm.reach : 1)),
    );
  }

  function errorOf(arm, q, target, rowCount) {
    const { gap, turn } = away(arm.pose(q), target);
    return [...gap.map((entry) => entry / arm.reach), ...turn].slice(0, rowCount);
  }

  /** A step that stays within the limits; joints that would leave them are held there. */
  function limited(arm, q, rows, error, damping, stride) {
    const free = q.map(() => true);
    for (;;) {
      const change = step(rows, error, free, damping);
      const largest = Math.max(...change.map(Math.abs), stride);
      const moved = q.map((value, i) => value + (change[i] * stride * arm.units[i]) / largest);
      const over = moved.map((value, i) => free[i] && arm.limits[i] && beyond(value, arm.limits[i]));
      if (!over.some(Boolean)) {
        return moved;
      }
      over.forEach((isOver, i) => {
        if (isOver) {
          free[i] = false;
          q[i] = Math.min(Math.max(moved[i], arm.limits[i][0]), arm.limits[i][1]);
        }
      });
    }
  }

  const beyond = (value, [low, high]) => value < low || value > high;

  /**
   * Damped least squares from some joints towards a target, in bounded steps within the limits.
   *
   * The damping grows where a step does not help and shrinks where it does (Levenberg and Marquardt).
   * attitude: whether orientation counts. Returns joints, distances, and whether the target is reached.
   */
  function search(arm, start, target, { attitude = true, steps = 120, stride = 0.2, tolerance = 1e-9 } = {}) {
    const rowCount = attitude ? 6 : 3;
    let q = Array.from(start);
    let error = errorOf(arm, q, target, rowCount);
    let damping = 1e-4;
    for (let count = 0; count < steps && algebra.norm(error) > tolerance && damping < 1e6; count++) {
      const moved = limited(arm, q.slice(), scaled(arm, q, rowCount), error, damping, stride);
      const next = errorOf(arm, moved, target, rowCount);
      if (algebra.norm(next) < algebra.norm(error)) {
        [q, error, damping] = [moved, next, Math.max(damping / 8, 1e-14)];
      } else {
        damping *= 16;
      }
    }
    const { length, turn } = away(arm.pose(q), target);
    const angle = algebra.norm(turn);
    return { q, length, angle, reached: length <= 1e-6 * arm.reach && (!attitude || angle <= 1e-6) };
  }

  /** A search for position and orientation; an arm that cannot have both gets the position where that is possible. */
  function approach(arm, start, target, attitude) {
    const found = search(arm, start, target, { attitude });
    if (found.reached || !attitude || arm.rank >= 6) {
      return found;
    }
    const second = search(arm, found.q, target, { attitude: false });
    return { ...second, reached: false };
  }

  return { away, nearTurn, branches, nearest, search, approach, scaled };
})();
