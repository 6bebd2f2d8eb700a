// The page of a robot in a cell: it stays in a frame of its own, and joints go to and fro as messages.
function render({ model, el }) {
  const frame = document.createElement("iframe");
  frame.setAttribute("sandbox", "allow-scripts");
  frame.setAttribute("allow", "clipboard-write");
  frame.title = model.get("title");
  frame.style.cssText = `width: 100%; border: 0; height: ${model.get("height")}px`;
  frame.srcdoc = model.get("page");

  // What the page has said itself is not sent back to it: it may have moved on since.
  let heard = "";
  const send = () => {
    const q = model.get("q");
    if (JSON.stringify(q) !== heard) frame.contentWindow?.postMessage({ kinegen: 1, q }, "*");
    heard = "";
  };
  const take = ({ source, data }) => {
    if (source !== frame.contentWindow || data?.kinegen !== 1) return;
    if (data.ready) return send();
    heard = JSON.stringify(data.q);
    model.set("q", data.q);
    model.save_changes();
  };

  window.addEventListener("message", take);
  model.on("change:q", send);
  el.append(frame);
  return () => {
    window.removeEventListener("message", take);
    model.off("change:q", send);
  };
}

export default { render };
