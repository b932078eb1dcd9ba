// The picture on the canvas: the camera, what is seen, and when it has to be drawn anew.

import { attach, Camera } from "./camera.js";
import { Painter } from "./painter.js";
import { element } from "./panel.js";

const SLOW = 30; // milliseconds a picture, from which on motion is drawn with fewer samples
const REST = 180; // milliseconds without motion, after which there are more samples again
const KEPT = 1e4; // pixels a side that are drawn at most

export class Screen {
  // lost() is called when the graphics card is taken away.
  constructor(canvas, lost) {
    this.canvas = canvas;
    this.painter = new Painter(canvas);
    canvas.addEventListener("webglcontextlost", lost);
    this.packets = { still: null, frame: null };
    this.moved = 0; // when something was moved last
    this.pace = 0; // milliseconds a picture, of late
    this.pictures = 0; // drawn so far
    attach(() => this.camera, canvas, () => this.touch(), () => this.fit());
  }

  // What to show; the camera stays where it is.
  open(scene) {
    this.scene = scene;
    this.camera ??= new Camera(scene.up, scene.camera);
  }

  // Take over a packet, instead of the one before; layer: "still" or "frame".
  upload(layer, packet) {
    this.painter.upload(layer, packet);
    this.packets[layer] = packet;
    this.touch();
  }

  // How many rows of an array there are.
  count(name) {
    return Object.values(this.packets).reduce((sum, packet) => sum + (packet?.arrays[name]?.count ?? 0), 0);
  }

  get box() {
    const boxes = Object.values(this.packets).map((packet) => packet?.box).filter(Boolean);
    if (!boxes.length) return [[-1, -1, -1], [1, 1, 1]];
    const ends = (k, choose) => [0, 1, 2].map((i) => choose(...boxes.map((box) => box[k][i])));
    return [ends(0, Math.min), ends(1, Math.max)];
  }

  fit() {
    const { clientWidth: width, clientHeight: height } = this.canvas;
    const below = (height - element("footer").offsetTop) / height;
    const right = (width - element("panel").offsetLeft) / width;
    // On a small page they may lie on the picture.
    this.camera.fit(this.box, width / height, below < 0.3 ? below : 0, right < 0.3 ? right : 0);
    this.touch();
  }

  // Something looks different now.
  touch() {
    this.moved = performance.now();
    this.stale = true;
  }

  // Draw, if it is needed. look: boundaries, grid, playing; elapsed: milliseconds since the last time.
  refresh(look, elapsed) {
    if (this.resized()) this.touch();
    const resting = performance.now() - this.moved > REST && !look.playing;
    if (this.stale) {
      this.pace += 0.2 * (elapsed - this.pace);
      this.draw(look, this.pace < SLOW ? 2 : 1);
      this.stale = false;
    } else if (resting && this.samples < 2 && this.pace < 4 * SLOW) {
      this.draw(look, 2);
    }
  }

  resized() {
    const ratio = window.devicePixelRatio || 1;
    const size = [this.canvas.clientWidth, this.canvas.clientHeight];
    const [width, height] = size.map((x) => Math.max(1, Math.min(KEPT, Math.round(x * ratio))));
    if (this.canvas.width === width && this.canvas.height === height) return false;
    Object.assign(this.canvas, { width, height });
    return true;
  }

  draw({ boundaries, grid }, samples) {
    if (!this.packets.still) return;
    this.resized();
    const { up, floor } = this.scene;
    const box = this.box;
    const lowest = box[0].reduce((s, x, k) => s + x * up[k], 0);
    this.painter.draw({
      camera: this.camera, box, up, boundaries,
      samples: window.devicePixelRatio >= 2 ? 1 : samples, // small pixels need no more
      floor: grid ? floor ?? lowest : null,
    });
    this.samples = samples;
    this.pictures += 1;
  }
}
