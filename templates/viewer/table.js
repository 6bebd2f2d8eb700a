// The table beside the arm: rows that light up their frames and dimensions, and that play as elementary transforms.
(() => {
  const { tables, missing } = app.model.tables;
  const GREEK = { alpha: "α", beta: "β", theta: "θ", a: "a", d: "d" };
  const AXIS_LENGTH = 0.13 * app.size;
  const layer = shapes.layer(20);
  const still = window.matchMedia("(prefers-reduced-motion: reduce)");
  const rowButtons = new Map();
  const play = { table: 0, row: 0, time: 0, isRunning: false, isShown: false, last: 0 };
  let pointed = null;
  let pinned = null;

  const scope = () => ({ q: app.state.q, parameters: app.state.parameters });
  const colourOf = (kind) => kind[1];

  /** An amount as people read it: degrees or radians, or a length with its unit. */
  function shown(amount, turns) {
    if (!turns) return `${shortNumber(amount, 5)} ${app.model.units.length}`;
    return app.state.unit === "deg" ? `${shortNumber(app.shown(amount, true), 2)}°` : `${shortNumber(amount)} rad`;
  }

  function stepText(step, amount) {
    const name = step.column ? `${GREEK[step.column]} = ` : "";
    return `${step.kind}(${name}${shown(amount, step.kind[0] === "R")})`;
  }

  // The picture ------------------------------------------------------------------------------------------------------

  /** A line or an arc with its value; share is how much of it has been played. */
  function drawDimension(dimension, share) {
    const part = { ...dimension, amount: dimension.amount * share };
    const paint = shapes.paint(colourOf(dimension.kind));
    const text = `${GREEK[dimension.column] ?? dimension.kind} = ${shown(part.amount, dimension.turns)}`;
    if (!dimension.turns) {
      const to = dimension.from.map((entry, i) => entry + share * (dimension.to[i] - entry));
      layer.rod(dimension.from, to, paint, 1.5 * shapes.width);
      layer.ball(dimension.from, 2.6 * shapes.width, paint);
      layer.ball(to, 2.6 * shapes.width, paint);
      const middle = dimension.from.map((entry, i) => (entry + to[i]) / 2);
      layer.name(text, middle, "dimension");
      return;
    }
    const radius = AXIS_LENGTH * (dimension.kind[1] === "z" ? 0.72 : 0.58);
    const points = story.arc(part, radius);
    layer.arc(points, paint);
    if (points.length > 2) layer.arrow(points.at(-2), points.at(-1).map((entry, i) => entry + 0.02 * (entry - points.at(-2)[i])), paint);
    for (const end of [points[0], points.at(-1)]) layer.rod(dimension.from, end, paint, 0.5 * shapes.width);
    layer.name(text, points[points.length >> 1], "dimension");
  }

  /** Both frames of a row, the axes between which its common normal is, and its dimensions. */
  function drawRow(tableIndex, rowIndex) {
    const table = tables[tableIndex];
    const row = table.rows[rowIndex];
    const around = story.within(table, rowIndex, scope());
    const [first, last] = [around[0], around.at(-1)];
    layer.axes(first, AXIS_LENGTH, 1.2 * shapes.width);
    layer.axes(last, AXIS_LENGTH, 1.2 * shapes.width);
    for (const frame of [first, last]) {
      const [at, z] = [algebra.origin(frame), algebra.axis(frame, 2)];
      const end = (sign) => at.map((entry, i) => entry + sign * 0.3 * app.size * z[i]);
      layer.rod(end(-1), end(1), shapes.paint("z", 0.45), 0.4 * shapes.width);
    }
    for (const each of story.dimensions(table, rowIndex, scope())) drawDimension(each, 1);
    layer.name(`{${row.parent < 0 ? 0 : table.rows[row.parent].number}}`, algebra.origin(first), "frame");
    layer.name(`{${row.number}}`, algebra.origin(last), "frame");
  }

  /** A row at a time: what has been done, and the frame on its way. */
  function drawPlay() {
    const table = tables[play.table];
    const around = story.within(table, play.row, scope());
    layer.axes(around[0], 0.8 * AXIS_LENGTH, shapes.width);
    for (const each of story.dimensions(table, play.row, scope())) {
      const share = Math.min(Math.max(play.time - each.place, 0), 1);
      if (share > 0) drawDimension(each, share);
    }
    const moving = story.at(table, play.row, scope(), play.time);
    layer.axes(moving, 1.15 * AXIS_LENGTH, 2 * shapes.width);
    layer.ball(algebra.origin(moving), 5 * shapes.width, shapes.paint("highlight"));
  }

  function draw() {
    layer.clear();
    const target = pointed ?? pinned;
    if (play.isShown) drawPlay();
    else if (target) drawRow(...target);
    marks(target);
    app.three.requestDraw();
  }

  /** The rows and steps that are lit in the tables. */
  function marks(target) {
    for (const [key, { line, cells, button }] of rowButtons) {
      const isPlayed = play.isShown && key === `${play.table} ${play.row}`;
      line.classList.toggle("lit", isPlayed || (!play.isShown && target !== null && key === target.join(" ")));
      button.setAttribute("aria-pressed", String(pinned !== null && key === pinned.join(" ")));
      const step = isPlayed ? Math.max(0, Math.ceil(play.time) - 1) : -1;
      cells.forEach((cell, place) => cell?.classList.toggle("step", place === step));
    }
  }

  function point(target) {
    pointed = target;
    if (target) explain(target);
    app.emit("row", target !== null && tables[target[0]].own ? target[1] : null);
    draw();
  }

  function pin(target) {
    pinned = pinned !== null && pinned.join() === target.join() ? null : target;
    choose(...target);
    draw();
  }

  // Playing ----------------------------------------------------------------------------------------------------------

  const status = element("p", { class: "note", role: "status", id: "play-status" });
  const speed = element("select", { id: "play-speed" }, ...[["0.5", "half speed"], ["1", "normal speed"], ["2", "double speed"]].map(([value, text]) => element("option", { value, selected: value === "1" }, text)));
  const onward = element("input", { type: "checkbox", id: "play-onward" });
  const which = element("span", { id: "play-row" });

  function choose(table, row) {
    [play.table, play.row, play.time] = [table, row, 0];
    play.isRunning = play.isShown = false;
    const each = tables[table];
    which.textContent = each.rows.length ? `Row ${each.rows[row].number}, ${each.rows[row].name} (${each.title})` : "No rows";
    status.textContent = "";
    showPlay();
  }

  /** What is being done now, in words. */
  function say(place = Math.min(Math.floor(play.time), tables[play.table].rows[play.row].steps.length - 1)) {
    const { steps } = tables[play.table].rows[play.row];
    if (place < 0) {
      status.textContent = "This row has no transform.";
      return;
    }
    const step = steps[place];
    const amount = algebra.value(step.value, scope());
    const isDone = play.time >= steps.length;
    const text = `${place + 1} of ${steps.length}: ${stepText(step, amount)}${amount === 0 ? ", nothing to move" : ""}${isDone ? "; done" : ""}`;
    if (status.textContent !== text) status.textContent = text;
  }

  function showPlay() {
    playButton.textContent = play.isRunning ? "Pause" : "Play";
    draw();
  }

  function start() {
    const { steps } = tables[play.table].rows[play.row];
    if (play.time >= steps.length) play.time = 0;
    [play.isRunning, play.isShown, play.last] = [true, true, 0];
    say();
    showPlay();
    window.requestAnimationFrame(tick);
  }

  function pause() {
    play.isRunning = false;
    showPlay();
  }

  function stop() {
    choose(play.table, play.row);
  }

  /** To the end of the step under way, or of the next one. */
  function single() {
    const { steps } = tables[play.table].rows[play.row];
    if (play.time >= steps.length) play.time = 0;
    play.isRunning = false;
    play.isShown = true;
    play.time = Math.min(Math.floor(play.time) + 1, steps.length);
    say(play.time - 1);
    showPlay();
  }

  /** Time goes on; with reduced motion whole steps follow each other without movement. */
  function tick(now) {
    if (!play.isRunning) return;
    const seconds = play.last ? Math.min((now - play.last) / 1000, 0.1) * Number(speed.value) : 0;
    play.last = now;
    const before = Math.floor(play.time);
    const table = tables[play.table];
    if (still.matches) {
      play.waited = (play.waited ?? 0) + seconds;
      if (play.waited >= 1) [play.time, play.waited] = [Math.min(before + 1, table.rows[play.row].steps.length), 0];
    } else {
      play.time = story.advance(table, play.row, scope(), play.time, seconds / 1.2);
    }
    if (play.time >= table.rows[play.row].steps.length) ended(table);
    else if (Math.floor(play.time) !== before) say();
    draw();
    if (play.isRunning) window.requestAnimationFrame(tick);
  }

  function ended(table) {
    say();
    if (onward.checked && play.row + 1 < table.rows.length) {
      choose(play.table, play.row + 1);
      start();
      return;
    }
    play.isRunning = false;
    showPlay();
  }

  const playButton = app.button("Play", "Play the elementary transforms of the row one after the other", () => (play.isRunning ? pause() : start()));
  playButton.id = "play";

  // The tables -------------------------------------------------------------------------------------------------------

  function build() {
    const body = app.panel("table", "Table");
    const shownTables = tables.map((table, index) => {
      const block = element("div", { class: "dh", hidden: index > 0 }, ...tableBlock(table, index));
      block.append(...table.notes.map((note) => element("p", { class: "note" }, `Free choice: ${note}`)));
      return block;
    });
    const toggles = tables.slice(1).map((table, index) =>
      app.toggle(`Show ${table.title}`, `Show the ${table.title} table of the same arm too`, false, (wanted) => {
        shownTables[index + 1].hidden = !wanted;
        if (!wanted && pinned?.[0] === index + 1) pinned = null;
        if (!wanted && play.table === index + 1) choose(0, 0);
        draw();
      }),
    );
    if (toggles.length) body.append(element("div", { class: "bar", id: "conventions" }, ...toggles));
    body.append(...shownTables, ...missing.map((text) => element("p", { class: "note" }, text)));
    if (tables[0].rows.length) body.append(player());
  }

  function player() {
    const step = app.button("Step", "Apply the next elementary transform", single);
    const end = app.button("Stop", "Stop playing", stop);
    const bar = element("div", { class: "bar" }, playButton, step, end, element("label", { for: "play-speed", class: "hidden" }, "Speed"), speed);
    choose(0, 0);
    return element("div", { id: "player", role: "group", "aria-label": "Play a row" }, which, bar, element("label", { class: "check" }, onward, "continue with the next row"), status);
  }

  function tableBlock(table, index) {
    const heads = table.columns.map(([column, place]) => element("th", { scope: "col" }, element("i", {}, GREEK[column]), place ? element("sub", {}, place) : ""));
    const sequences = table.rows.some((row) => !row.steps.every((step) => step.column)) || !table.columns.length;
    const head = element("tr", {}, element("th", { scope: "col" }, "i"), element("th", { scope: "col" }, "joint"), ...heads, ...(sequences ? [element("th", { scope: "col", class: "sequence" }, "transforms")] : []));
    const lines = table.rows.map((row, place) => rowLine(table, index, row, place, sequences));
    const about = [table.title, table.own ? "as in the file" : "the same arm", table.product].filter(Boolean).join(", ");
    const made = element("table", {}, element("caption", {}, about), element("thead", {}, head), element("tbody", {}, ...lines));
    return [element("div", { class: "wide", tabindex: 0, role: "region", "aria-label": `${table.title} table` }, made)];
  }

  function rowLine(table, index, row, place, sequences) {
    const button = element("button", { type: "button", class: "row", "aria-pressed": "false", title: "Keep this row highlighted, and select it for playing" }, row.name);
    const cells = [];
    const line = element("tr", {}, element("td", {}, String(row.number)), element("th", { scope: "row" }, button));
    table.columns.forEach(([column], number) => {
      const cell = element("td", {});
      if (row.cells[number]) cell.append(app.math(row.cells[number]));
      const at = row.steps.findIndex((step) => step.column === column);
      if (at >= 0) cells[at] = cell;
      line.append(cell);
    });
    if (sequences) line.append(sequence(row, cells));
    button.addEventListener("click", () => pin([index, place]));
    button.addEventListener("focus", () => {
      if (!play.isShown) choose(index, place);
      point([index, place]);
    });
    button.addEventListener("blur", () => point(null));
    button.addEventListener("keydown", (event) => move(event, index, place));
    line.addEventListener("pointerenter", () => point([index, place]));
    line.addEventListener("pointerleave", () => point(null));
    rowButtons.set(`${index} ${place}`, { line, cells, button });
    return line;
  }

  /** The transforms of a row that has no entries, each of them a cell that can be lit. */
  function sequence(row, cells) {
    const cell = element("td", { class: "sequence" });
    row.steps.forEach((step, place) => {
      if (step.column) return;
      cells[place] = element("span", {}, step.kind, "(", app.math(step.text), ")");
      cell.append(cells[place], " ");
    });
    return cell;
  }

  /** Up and down lead from row to row. */
  function move(event, index, place) {
    const to = { ArrowDown: place + 1, ArrowUp: place - 1 }[event.key];
    const other = rowButtons.get(`${index} ${to}`);
    if (to === undefined || !other) return;
    event.preventDefault();
    other.button.focus();
  }

  /** The present values of a row, as titles of its cells. */
  function explain([index, place]) {
    const { cells } = rowButtons.get(`${index} ${place}`);
    tables[index].rows[place].steps.forEach((step, number) => {
      if (cells[number]) cells[number].title = stepText(step, algebra.value(step.value, scope()));
    });
  }

  function refresh() {
    if (play.isShown || pointed || pinned) draw();
  }

  build();
  app.on("joints", refresh);
  app.on("unit", refresh);
  app.on("theme", refresh);
})();
