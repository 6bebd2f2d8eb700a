// node render.cjs MODULES FILE: FILE is a JSON list of LaTeX displays; prints each that KaTeX or MathJax refuses.
const path = require("path");
const fs = require("fs");

const [modules, file] = process.argv.slice(2);
const load = (name) => require(path.resolve(modules, name));
const katex = load("katex");
const { mathjax } = load("mathjax-full/js/mathjax.js");
const { TeX } = load("mathjax-full/js/input/tex.js");
load("mathjax-full/js/input/tex/AllPackages.js");
const { SVG } = load("mathjax-full/js/output/svg.js");
const { liteAdaptor } = load("mathjax-full/js/adaptors/liteAdaptor.js");
const { RegisterHTMLHandler } = load("mathjax-full/js/handlers/html.js");

RegisterHTMLHandler(liteAdaptor());
const refuse = (_, error) => {
  throw error;
};
const page = mathjax.document("", {
  InputJax: new TeX({ packages: ["base", "ams"], formatError: refuse }),
  OutputJax: new SVG({ fontCache: "none" }),
});
const renderers = {
  katex: (display) => katex.renderToString(display, { displayMode: true, throwOnError: true, strict: "error" }),
  mathjax: (display) => page.convert(display, { display: true }),
};

const displays = JSON.parse(fs.readFileSync(file, "utf8"));
for (const display of displays) {
  for (const [name, render] of Object.entries(renderers)) {
    try {
      render(display);
    } catch (error) {
      console.log(`${name}: ${error.message}: ${display.slice(0, 120)}`);
    }
  }
}
console.log(`${displays.length} displays`);
