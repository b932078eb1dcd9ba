// The controls and the legend: they show the state, and tell when a person changes it, as keys do.

const NUMBER = new Intl.NumberFormat("en");

export const element = (id) => document.getElementById(id);

const css = (rgb) => `rgb(${rgb.join(" ")})`;

function options(select, choices) {
  select.replaceChildren(...choices.map(([value, text]) => new Option(text, value)));
}

export class Panel {
  // changed(change) is called with what a person has chosen: some of world, apart, color, map, low,
  // high, auto, boundaries, grid, speed.
  constructor(changed) {
    const chosen = (id, change) => element(id).addEventListener("change", (event) => {
      changed(change(event.target));
      event.target.blur(); // so that keys go to the scene again
    });
    chosen("world", ({ value }) => ({ world: value === "" ? null : Number(value) }));
    chosen("apart", ({ checked }) => ({ apart: checked }));
    chosen("color", ({ value }) => ({ color: value || null, auto: true }));
    chosen("map", ({ value }) => ({ map: value }));
    chosen("boundaries", ({ value }) => ({ boundaries: value }));
    chosen("grid", ({ checked }) => ({ grid: checked }));
    chosen("speed", ({ value }) => ({ speed: Number(value) }));
    for (const end of ["low", "high"]) {
      chosen(end, ({ valueAsNumber: x }) => (Number.isFinite(x) ? { [end]: x, auto: false } : { auto: true }));
    }
    element("auto").addEventListener("click", () => changed({ auto: true }));
  }

  // What there is to choose from.
  offer(scene) {
    this.scene = scene;
    element("title").textContent = scene.title;
    document.title = `${scene.title} · particlesim view`;
    options(element("world"), [["", `all ${scene.worlds.length}`], ...scene.worlds.map((w) => [w, `${w}`])]);
    options(element("color"), [["", "by group"], ...scene.fields.map((name) => [name, name])]);
    options(element("map"), Object.keys(scene.maps).map((name) => [name, name]));
    element("world-row").hidden = scene.worlds.length < 2;
    element("groups").replaceChildren(...scene.groups.map(({ name, color }) => {
      const [item, dot] = [document.createElement("li"), document.createElement("i")];
      dot.style.background = css(color);
      item.append(dot, name);
      return item;
    }));
    element("reset").hidden = !scene.live;
  }

  // What is chosen.
  show(state) {
    element("world").value = state.world ?? "";
    element("apart-row").hidden = !this.scene.coinciding || state.world !== null;
    element("apart").checked = state.apart;
    element("color").value = state.color ?? "";
    element("map").value = state.map;
    element("map-row").hidden = state.color === null;
    element("boundaries").value = state.boundaries;
    element("grid").checked = state.grid;
    element("speed").value = state.speed;
    element("scale").hidden = state.color === null;
    element("groups").hidden = state.color !== null;
    element("legend").hidden = state.color === null && !this.scene.groups.length;
    if (state.color === null) return;
    element("scale-name").textContent = state.color;
    for (const end of ["low", "high"]) {
      // Not while a person writes there.
      if (document.activeElement !== element(end)) element(end).value = Number(state[end].toPrecision(4));
    }
    const bar = element("scale-bar");
    const painter = bar.getContext("2d");
    const steps = this.scene.maps[state.map];
    const ramp = painter.createLinearGradient(0, 0, bar.width, 0);
    steps.forEach((color, k) => ramp.addColorStop(k / (steps.length - 1), css(color)));
    painter.fillStyle = ramp;
    painter.fillRect(0, 0, bar.width, bar.height);
  }

  // Where in time.
  time({ index, codes, playing, live, seconds }) {
    const last = Math.max(codes.length - 1, live ? live.planned : 0);
    const slider = element("slider");
    slider.max = last;
    slider.value = index;
    const code = codes[index] ?? 0;
    element("play").textContent = playing ? "❚❚ Pause" : "▶ Play";
    const computed = live && live.done < live.planned ? ` (${live.done} computed)` : "";
    const end = live ? live.planned : codes[codes.length - 1];
    element("time").textContent = `frame ${code} / ${end}${computed} · ${seconds.toPrecision(4)} s`;
  }

  counts({ particles, links, triangles }) {
    const parts = [[particles, "particles"], [links, "links"], [triangles, "triangles"]];
    const said = parts.filter(([n]) => n).map(([n, name]) => `${NUMBER.format(n)} ${name}`);
    element("counts").textContent = said.join(" · ");
  }

  complain(message) {
    element("message").textContent = message;
    element("error").hidden = message === "";
  }
}

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
