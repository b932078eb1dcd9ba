// Buttons, the slider and keys: what they do to the view.

import { element } from "./panel.js";

export function listen(view) {
  element("play").addEventListener("click", () => view.play(!view.state.playing));
  element("reset").addEventListener("click", () => view.reset());
  element("fit").addEventListener("click", () => view.screen.fit());
  element("dismiss").addEventListener("click", () => view.panel.complain(""));
  element("slider").addEventListener("input", ({ target }) => view.stepTo(target.valueAsNumber));
  const turnWorld = (step) => {
    const worlds = [null, ...view.scene.worlds];
    const at = worlds.indexOf(view.state.world) + step;
    if (worlds.length > 2 && at >= 0 && at < worlds.length) view.change({ world: worlds[at] });
  };
  const keys = {
    " ": () => view.play(!view.state.playing),
    ArrowRight: ({ shiftKey }) => view.stepTo(view.state.index + (shiftKey ? 10 : 1)),
    ArrowLeft: ({ shiftKey }) => view.stepTo(view.state.index - (shiftKey ? 10 : 1)),
    ArrowUp: () => turnWorld(-1),
    ArrowDown: () => turnWorld(1),
    Home: () => view.stepTo(0),
    End: () => view.stepTo(Infinity),
    f: () => view.screen.fit(),
    r: () => view.live && view.reset(),
  };
  window.addEventListener("keydown", (event) => {
    const typing = event.target.matches?.("select, input[type=number]");
    const pressed = event.key === " " && event.target.matches?.("button:not(#play), [type=checkbox]");
    const work = keys[event.key.length === 1 ? event.key.toLowerCase() : event.key];
    if (!work || typing || pressed || event.ctrlKey || event.metaKey || event.altKey) return;
    event.preventDefault();
    work(event);
  });
}
