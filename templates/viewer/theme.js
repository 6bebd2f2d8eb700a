// Light and dark: what the system prefers, until the button is used.

const PALETTES = {
  light: {
    background: "#f4f6f9",
    link: "#d9dee6",
    joint: "#5c7191",
    accent: "#e8720c",
    slide: "#8b97a8",
    base: "#6d7c92",
    tool: "#a3afbf",
    grid: "#c3cbd6",
    gridAxis: "#8f9bab",
    x: "#d32f2f",
    y: "#2e8b37",
    z: "#1f62d0",
    text: "#1b2430",
    highlight: "#c2185b",
    ghost: "#5b6b82",
    trace: "#7b1fa2",
  },
  dark: {
    background: "#12161d",
    link: "#bcc6d4",
    joint: "#6a7f9e",
    accent: "#ff9a3c",
    slide: "#77859a",
    base: "#5b6b82",
    tool: "#d5dce6",
    grid: "#2b3442",
    gridAxis: "#4a5769",
    x: "#ff6b6b",
    y: "#5fd068",
    z: "#6aa5ff",
    text: "#e8edf4",
    highlight: "#ff7eb6",
    ghost: "#8fa0b8",
    trace: "#d59bf6",
  },
};

const preferred = window.matchMedia("(prefers-color-scheme: dark)");
let chosen = null;
let isPrinting = false;

app.theme = () => (isPrinting ? "light" : (chosen ?? (preferred.matches ? "dark" : "light")));

// Colours of the present theme, as CSS writes them.
app.colours = () => PALETTES[app.theme()];

app.setTheme = (theme) => {
  chosen = theme;
  announce();
};

function announce() {
  document.documentElement.dataset.theme = app.theme();
  app.emit("theme", app.theme());
  app.three?.requestDraw();
}

// Paper is light. The picture has to be drawn before the page is printed.
function print(isOn) {
  isPrinting = isOn;
  announce();
  app.three?.draw();
}

window.addEventListener("beforeprint", () => print(true));
window.addEventListener("afterprint", () => print(false));
preferred.addEventListener("change", () => chosen === null && announce());
document.documentElement.dataset.theme = app.theme();
