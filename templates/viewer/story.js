// A table as a chain of elementary transforms: its frames, what a row measures, and a row as motions in time.
const story = (() => {
  const NOTHING = 1e-12;

  /** A frame with some steps behind it: the frames before the first, between them, and behind the last. */
  function between(start, steps, scope) {
    const found = [start];
    for (const step of steps) {
      found.push(multiply(found.at(-1), elementary(step.kind, algebra.value(step.value, scope))));
    }
    return found;
  }

  /** All frames of a table: `root` after the base transform, one for each row, and the tool. */
  function frames(table, scope) {
    const root = between(identity(), table.base, scope).at(-1);
    const rows = [];
    for (const row of table.rows) {
      rows.push(between(row.parent < 0 ? root : rows[row.parent], row.steps, scope).at(-1));
    }
    return { root, rows, tool: between(rows.at(-1) ?? root, table.tool, scope).at(-1) };
  }

  /** The frames within a row, one more than it has steps. */
  function within(table, number, scope) {
    const found = frames(table, scope);
    const row = table.rows[number];
    return between(row.parent < 0 ? found.root : found.rows[row.parent], row.steps, scope);
  }

  /**
   * What a row measures, as lines and arcs in space: each step that does something, with the frames around it. A line
   * leads from one origin to the other; an arc begins at an axis of the frame before and turns about `about`.
   */
  function dimensions(table, number, scope) {
    const around = within(table, number, scope);
    const found = [];
    table.rows[number].steps.forEach((step, place) => {
      const amount = algebra.value(step.value, scope);
      const turns = step.kind[0] === "R";
      if (Math.abs(amount) <= NOTHING) {
        return;
      }
      const [before, after] = [around[place], around[place + 1]];
      const axis = "xyz".indexOf(step.kind[1]);
      found.push({
        place,
        kind: step.kind,
        column: step.column ?? "",
        amount,
        turns,
        from: algebra.origin(before),
        to: algebra.origin(after),
        about: algebra.axis(before, axis),
        // The twist is seen between two z axes, a turn about z between two x axes.
        start: algebra.axis(before, axis === 2 ? 0 : 2),
      });
    });
    return found;
  }

  /** Points along the arm: for each row, and for base and tool, the origins between its elementary transforms. */
  function path(table, scope) {
    const base = between(identity(), table.base, scope);
    const found = [base];
    const rows = [];
    for (const row of table.rows) {
      const way = between(row.parent < 0 ? base.at(-1) : rows[row.parent], row.steps, scope);
      rows.push(way.at(-1));
      found.push(way);
    }
    found.push(between(rows.at(-1) ?? base.at(-1), table.tool, scope));
    return found.map((way) => way.map(algebra.origin));
  }

  /** A vector turned about a unit vector. */
  function turned(vector, about, angle) {
    const [cosine, sine] = [Math.cos(angle), Math.sin(angle)];
    const along = algebra.dot(vector, about) * (1 - cosine);
    const cross = [0, 1, 2].map((i) => {
      const [j, k] = [(i + 1) % 3, (i + 2) % 3];
      return about[j] * vector[k] - about[k] * vector[j];
    });
    return vector.map((entry, i) => entry * cosine + cross[i] * sine + about[i] * along);
  }

  /** Points of an arc of some radius about a point; angles beyond a turn are drawn as what is left of them. */
  function arc(dimension, radius, most = 48) {
    const shown = Math.abs(dimension.amount) > 2 * Math.PI ? dimension.amount % (2 * Math.PI) : dimension.amount;
    const count = Math.max(2, Math.ceil((Math.abs(shown) / (2 * Math.PI)) * most));
    return Array.from({ length: count + 1 }, (_, place) =>
      turned(dimension.start, dimension.about, (shown * place) / count).map(
        (entry, i) => dimension.from[i] + radius * entry,
      ),
    );
  }

  /** The frame at a time in a row, in steps: 2.5 is half of the third step. */
  function at(table, number, scope, time) {
    const row = table.rows[number];
    const place = Math.min(Math.floor(time), row.steps.length - 1);
    const start = within(table, number, scope);
    if (place < 0) {
      return start[0];
    }
    const step = row.steps[place];
    const share = Math.min(time - place, 1);
    return multiply(start[place], elementary(step.kind, algebra.value(step.value, scope) * share));
  }

  /** The next time after some seconds; steps that do nothing take a quarter of the time. */
  function advance(table, number, scope, time, seconds) {
    const { steps } = table.rows[number];
    let left = seconds;
    let now = time;
    while (left > 0 && now < steps.length) {
      const step = steps[Math.floor(now)];
      const lasts = Math.abs(algebra.value(step.value, scope)) <= NOTHING ? 0.25 : 1;
      const end = Math.floor(now) + 1;
      const need = (end - now) * lasts;
      now = need <= left ? end : now + left / lasts;
      left -= need;
    }
    return now;
  }

  return { frames, within, path, dimensions, turned, arc, at, advance };
})();
