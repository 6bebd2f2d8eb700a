// A page inside another one, such as a cell of a notebook: what surrounds it sends joints, and is sent them.
//   received  {kinegen: 1, q: [...]}   numbers of another count or kind are left alone
//   sent      {kinegen: 1, ready: true}, then {kinegen: 1, q: [...]} after each change that was made here

const outside = window.parent === window ? null : window.parent;

if (outside !== null) {
  window.addEventListener("message", (event) => {
    const said = event.data;
    if (event.source !== outside || said?.kinegen !== 1 || !Array.isArray(said.q)) return;
    if (said.q.every((value) => typeof value === "number")) app.setJoints(said.q, "outside");
  });
  app.on("joints", ({ origin }) => {
    if (origin !== "outside" && origin !== "start") outside.postMessage({ kinegen: 1, q: Array.from(app.state.q) }, "*");
  });
  outside.postMessage({ kinegen: 1, ready: true }, "*");
}
