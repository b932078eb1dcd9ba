// The page: state, time, and what goes on between the controls, the server and the picture.

import { Film, ask, unpack } from "./film.js";
import { Panel, element, listen } from "./panel.js";
import { Screen } from "./screen.js";

const AHEAD = 8; // frames fetched before they are due
const POLL = { live: 200, file: 1500 }; // milliseconds between questions for news

class View {
  constructor() {
    const start = new URLSearchParams(location.hash.slice(1));
    this.start = start;
    this.state = {
      index: 0, playing: !start.has("paused"), speed: 1, world: null, apart: true, color: null,
      map: "viridis", low: 0, high: 1, auto: true, boundaries: "solid", grid: true,
    };
    this.panel = new Panel((change) => this.change(change));
    this.film = new Film((index) => this.arrived(index), (index, error) => this.missed(index, error));
    this.shown = null; // index of the frame in the picture
    this.due = 0; // frames that should have been shown since
    this.turn = 0; // of asking for frames anew
    this.refit = true; // see all of the next frame
    this.live = null;
  }

  async run() {
    this.panel.complain("");
    const lost = () => this.panel.complain("the graphics card was taken away; reload the page");
    this.screen = new Screen(element("canvas"), lost);
    await this.open();
    const { start, state, film } = this;
    state.grid = this.scene.floor !== null;
    const [world, color] = [Number(start.get("world") ?? NaN), start.get("color")];
    if (this.scene.worlds.includes(world)) state.world = world;
    if (start.has("frame")) state.index = Math.max(0, film.codes.indexOf(Number(start.get("frame"))));
    state.color = this.scene.fields.includes(color) ? color : this.scene.color;
    await this.requery();
    listen(this);
    requestAnimationFrame((now) => this.tick(now));
    if (this.live && state.playing) this.order("play");
    this.poll();
  }

  // Read what there is, at first and when it has been replaced.
  async open() {
    this.scene = await (await ask("scene")).json();
    this.film.codes = this.scene.frames;
    this.take = this.scene.take;
    this.live = this.scene.live;
    this.screen.open(this.scene);
    this.state.index = Math.min(this.state.index, this.film.codes.length - 1);
    this.panel.offer(this.scene);
  }

  // A change that a person has made.
  async change(change) {
    const { world } = this.state;
    Object.assign(this.state, change);
    const keys = ["world", "apart", "color", "map", "low", "high", "auto"];
    if (keys.some((key) => key in change)) {
      this.refit ||= this.state.world !== world || "apart" in change;
      await this.requery();
    }
    this.panel.show(this.state);
    this.screen.touch();
  }

  // Ask for frames anew, as the state wants them.
  async requery() {
    const { state, film } = this;
    const turn = ++this.turn;
    try {
      if (state.color && state.auto) {
        const span = await (await ask(`span?color=${encodeURIComponent(state.color)}`)).json();
        if (turn !== this.turn) return; // there has been another change since
        [state.low, state.high] = span;
        this.spanned = film.codes.length;
      }
      film.clear();
      film.query = this.query();
      const still = unpack(await (await ask(`still?${film.query}`)).arrayBuffer());
      if (turn !== this.turn) return;
      this.screen.upload("still", still);
      this.shown = null;
      this.panel.complain("");
    } catch (error) {
      this.panel.complain(error.message);
    }
    this.panel.show(state);
    this.present();
    this.fetch();
  }

  // The state in the words of the server.
  query() {
    const { world, apart, color, map, low, high } = this.state;
    const words = new URLSearchParams();
    if (world !== null) words.set("world", world);
    if (apart && this.scene.coinciding) words.set("apart", 1);
    for (const [key, value] of Object.entries(color ? { color, map, low, high } : {})) words.set(key, value);
    return words.toString();
  }

  // Frames that will be needed.
  fetch() {
    const { index, playing } = this.state;
    const count = this.film.codes.length;
    const ahead = playing ? AHEAD : 1;
    const wanted = Array.from({ length: Math.min(ahead, count) }, (_, k) => index + k);
    this.film.want(this.live ? wanted.filter((k) => k < count) : wanted.map((k) => k % count));
  }

  arrived(index) {
    if (index === this.state.index) this.present();
    this.fetch();
  }

  missed(index, error) {
    if (index === this.state.index) {
      this.panel.complain(error.message);
      this.state.playing = false;
      this.showTime();
    }
    this.fetch();
  }

  // Put the frame of the present index into the picture, if it is here.
  present() {
    const { index } = this.state;
    const { screen } = this;
    const packet = this.film.get(index);
    if (!packet || !screen.packets.still || this.shown === index) return;
    screen.upload("frame", packet);
    this.shown = index;
    this.panel.counts({
      particles: screen.count("thing.ball"), links: screen.count("thing.cone") / 2,
      triangles: (screen.count("thing.corner") + screen.count("thing.veil")) / 3,
    });
    if (this.refit) screen.fit();
    this.refit = false;
    this.showTime();
  }

  go(index) {
    const last = this.film.codes.length - 1;
    this.state.index = Math.max(0, Math.min(last, index));
    const error = this.film.refused.get(this.state.index);
    this.panel.complain(error ? error.message : "");
    this.present();
    this.showTime();
    this.fetch();
  }

  stepTo(index) {
    if (this.state.playing) this.play(false);
    this.go(index);
  }

  showTime() {
    const { index, playing } = this.state;
    const codes = this.film.codes;
    const seconds = ((codes[index] ?? 0) - (codes[0] ?? 0)) * this.scene.frameTime;
    this.panel.time({ index, codes, playing, live: this.live, seconds });
  }

  play(playing) {
    const { state, film } = this;
    state.playing = playing;
    this.due = 0;
    if (this.live) {
      if (playing && this.live.done >= this.live.planned && state.index >= film.codes.length - 1) state.index = 0;
      this.order(playing ? "play" : "pause");
    }
    this.showTime();
    this.fetch();
  }

  // Play, pause or reset the running scene.
  async order(order) {
    try {
      await this.news(await (await ask(`live/${order}`, { method: "POST" })).json(), 0);
    } catch (error) {
      this.panel.complain(error.message);
    }
  }

  async reset() {
    this.state.playing = false;
    this.state.index = 0;
    await this.order("reset");
    this.go(0);
  }

  // Ask for news again and again.
  async poll() {
    try {
      const since = this.film.codes.length;
      await this.news(await (await ask(`status?since=${since}`)).json(), since);
      if (this.lost) {
        this.panel.complain("");
        this.film.refused.clear();
        this.fetch();
      }
      this.lost = false;
    } catch (error) {
      this.lost = true;
      this.panel.complain(error.message);
    }
    setTimeout(() => this.poll(), this.live ? POLL.live : POLL.file);
  }

  async news({ take, frames, live }, since) {
    if (take !== this.take) {
      await this.open();
      this.refit = this.live === null;
      await this.requery();
    } else if (since === 0) {
      this.film.codes = frames;
    } else if (since === this.film.codes.length) {
      this.film.codes.push(...frames);
    }
    const failed = live?.error && live.error !== this.live?.error;
    this.live = live;
    if (failed) this.panel.complain(live.error);
    // The range of a value is known better with more frames.
    const { color, auto } = this.state;
    if (live && color && auto && this.film.codes.length >= 2 * this.spanned) await this.requery();
    this.showTime();
    this.fetch();
  }

  tick(now) {
    const elapsed = Math.min(now - (this.before ?? now), 200);
    this.before = now;
    if (this.state.playing) this.advance(elapsed);
    this.screen.refresh(this.state, elapsed);
    requestAnimationFrame((time) => this.tick(time));
  }

  // Show the next frame when it is time and it has come.
  advance(elapsed) {
    const { state, film } = this;
    this.due = Math.min(this.due + (elapsed / 1000) * this.scene.fps * state.speed, 4);
    while (this.due >= 1) {
      const last = state.index >= film.codes.length - 1;
      if (last && (this.live || film.codes.length < 2)) {
        state.playing = this.more;
        this.due = Math.min(this.due, 1);
        break;
      }
      const next = last ? 0 : state.index + 1;
      const damaged = film.refused.get(next);
      if (!film.get(next) && !damaged) {
        this.due = 1;
        break;
      }
      this.due -= 1;
      state.index = next;
      if (damaged) this.panel.complain(damaged.message);
    }
    this.present();
    this.showTime();
    this.fetch();
  }

  // Whether a running scene may have frames that are not known here yet.
  get more() {
    if (!this.live) return false;
    const { error, done, planned } = this.live;
    return this.film.codes.length <= done || (!error && done < planned);
  }
}

const view = new View();
window.particlesim = view; // for scripts and the console
view.run().catch((error) => view.panel.complain(error.message));
