// How an arm can move: axes of ellipsoids, the rank of a Jacobian, and joints that move nothing.
const spectrum = (() => {
  const SWEEPS = 60;
  // Directions of more joints take too long for every movement of a slider.
  const MOST_JOINTS = 40;

  /**
   * Eigenvalues and eigenvectors of a symmetric matrix by Jacobi's rotations.
   *
   * Takes n rows; gives pairs {value, vector}, the largest value first.
   */
  function eigen(matrix) {
    const n = matrix.length;
    // Squares of very small or large numbers leave the range of doubles.
    const size = Math.max(...matrix.flatMap((row) => Array.from(row, Math.abs))) || 1;
    const a = matrix.map((row) => Array.from(row, (entry) => entry / size));
    const v = a.map((_, i) => a.map((_, j) => Number(i === j)));
    for (let sweep = 0; sweep < SWEEPS && offDiagonal(a) > 0; sweep++) {
      for (let p = 0; p < n - 1; p++) {
        for (let q = p + 1; q < n; q++) {
          rotate(a, v, p, q);
        }
      }
    }
    const pairs = a.map((row, i) => ({ value: row[i] * size, vector: v.map((each) => each[i]) }));
    return pairs.sort((one, other) => other.value - one.value);
  }

  /** What is left beside the diagonal, 0 where it is lost in rounding. */
  function offDiagonal(a) {
    let [off, all] = [0, 0];
    a.forEach((row, i) =>
      row.forEach((entry, j) => {
        all += entry * entry;
        off += i === j ? 0 : entry * entry;
      }),
    );
    return off > 1e-34 * all ? off : 0;
  }

  /** One rotation that makes entry (p, q) zero. */
  function rotate(a, v, p, q) {
    if (a[p][q] === 0) {
      return;
    }
    const theta = (a[q][q] - a[p][p]) / (2 * a[p][q]);
    const t = (theta < 0 ? -1 : 1) / (Math.abs(theta) + Math.sqrt(theta * theta + 1));
    const c = 1 / Math.sqrt(t * t + 1);
    const s = t * c;
    for (const row of a) {
      [row[p], row[q]] = [c * row[p] - s * row[q], s * row[p] + c * row[q]];
    }
    for (let k = 0; k < a.length; k++) {
      [a[p][k], a[q][k]] = [c * a[p][k] - s * a[q][k], s * a[p][k] + c * a[q][k]];
    }
    a[p][q] = a[q][p] = 0;
    for (const row of v) {
      [row[p], row[q]] = [c * row[p] - s * row[q], s * row[p] + c * row[q]];
    }
  }

  /** Semi-axes of the ellipsoid J (all joint speeds of length 1): rows of J in, {length, vector} out. */
  function ellipsoid(rows) {
    const square = rows.map((one) => rows.map((other) => algebra.dot(one, other)));
    return eigen(square).map(({ value, vector }) => ({ length: Math.sqrt(Math.max(value, 0)), vector }));
  }

  /** Singular values of some rows, the largest first, with directions in the space of the columns. */
  function singular(rows) {
    const n = rows[0]?.length ?? 0;
    const square = Array.from({ length: n }, (_, i) =>
      Array.from({ length: n }, (_, j) => rows.reduce((sum, row) => sum + row[i] * row[j], 0)),
    );
    return eigen(square).map(({ value, vector }) => ({ value: Math.sqrt(Math.max(value, 0)), vector }));
  }

  /** Singular values alone, the largest first; six rows are quicker than many columns. */
  function singularValues(rows) {
    const values = ellipsoid(rows).map(({ length }) => length);
    return values.slice(0, Math.min(values.length, rows[0]?.length ?? 0));
  }

  /** Numbers from 0 to 1 that are the same each time. */
  function* steady() {
    for (let state = 1; ; ) {
      state = (state * 48271) % 2147483647;
      yield state / 2147483647;
    }
  }

  /**
   * What is usual for an arm: the rank of its Jacobian, and the middle of its smallest singular values.
   *
   * jacobian gives rows without units at joints q; box has the ends of each joint variable.
   */
  function usual(jacobian, box, samples = 64) {
    const numbers = steady();
    const found = Array.from({ length: samples }, () =>
      singularValues(jacobian(box.map(([low, high]) => low + (high - low) * numbers.next().value))),
    );
    const ranks = found.map((values) => values.filter((value) => value > 1e-6 * values[0]).length);
    const rank = Math.max(0, ...ranks);
    const smallest = found.map((values) => values[rank - 1] ?? 0).sort((one, other) => one - other);
    return { rank, typical: smallest[Math.floor(smallest.length / 2)] ?? 0 };
  }

  /**
   * How near to a singular pose an arm is.
   *
   * Returns share, the smallest singular value that is usually not zero as a share of its usual size, and direction, the
   * joint speeds that move the tip least; joints are listed with their parts, the largest first; none if there are more
   * than 40.
   */
  function nearness(rows, { rank, typical }) {
    if (!rank || !typical) {
      return { share: 1, joints: [] };
    }
    if (rows[0].length > MOST_JOINTS) {
      return { share: singularValues(rows)[rank - 1] / typical, joints: [] };
    }
    const { value, vector } = singular(rows)[rank - 1];
    const largest = Math.max(...vector.map(Math.abs));
    const weight = ({ part }) => Math.round(Math.abs(part) * 1000);
    const sign = Math.sign(vector.find((part) => Math.abs(part) > 0.999 * largest)) || 1;
    const joints = vector
      .map((part, joint) => ({ joint, part: (sign * part) / largest }))
      .filter((each) => Math.abs(each.part) > 0.1)
      .sort((one, other) => weight(other) - weight(one) || one.joint - other.joint);
    return { share: value / typical, joints };
  }

  /** The places (see kinegen/tools/viewer/panels.py) of which all zeros are less than a tenth of a radian or of the size away. */
  function near(places, q, steps) {
    const isNear = (tree) => {
      const at = app.valueOf(tree, q);
      const slopes = steps.map((step, joint) => {
        const beside = q.map((value, index) => (index === joint ? value + 1e-6 * step : value));
        return (app.valueOf(tree, beside) - at) / 1e-6;
      });
      return Math.abs(at) <= 0.1 * Math.hypot(...slopes);
    };
    return places.filter((place) => place.zeros.every(isNear));
  }

  return { eigen, ellipsoid, singular, usual, nearness, near };
})();
