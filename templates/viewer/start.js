// The first pose, the first picture, and keys.

if (!readLink()) app.setJoints(model.start ?? app.home(), "start");

window.addEventListener("keydown", (event) => {
  const isTyping = /^(INPUT|SELECT|TEXTAREA)$/.test(event.target.tagName);
  if (isTyping || event.ctrlKey || event.metaKey || event.altKey) return;
  if (event.key === "f") fit();
  if (event.key === "h") app.setJoints(app.home(), "home");
  if (event.key === "+" || event.key === "=") zoom(1 / 1.15);
  if (event.key === "-") zoom(1.15);
});
controls.listenToKeyEvents(canvas);
app.startScene();

// For tests and for pages that embed this one.
window.kinegen = app;
