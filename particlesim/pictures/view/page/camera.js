// A camera that goes around a target: yaw and pitch about the scene's up, and a distance.

const NEARLY_UP = 1.55; // radians; at a right angle up would be along the view
const ROOM = 1.06; // of the picture, around what is seen
const MOST_ZOOM = 1e4; // of the size of what is seen, either way

const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
const minus = (a, b) => a.map((x, k) => x - b[k]);
const plus = (a, b, s = 1) => a.map((x, k) => x + s * b[k]);
const length = (a) => Math.hypot(...a);

export class Camera {
  // up: the scene's; view: position, target and angle [degrees] of the recording's own camera.
  constructor(up, view) {
    this.up = up;
    // As recordings have it: with z up one looks along y, else along -z.
    this.out = up[2] > 0.5 ? [0, -1, 0] : [0, 0, 1];
    this.side = cross(up, this.out);
    this.slope = Math.tan((view.angle * Math.PI) / 360);
    this.target = view.target;
    const back = minus(view.position, view.target);
    this.distance = length(back);
    this.pitch = Math.asin(Math.max(-1, Math.min(1, dot(back, up) / this.distance)));
    this.yaw = Math.atan2(dot(back, this.side), dot(back, this.out));
    this.size = this.distance;
    this.turn(0, 0);
  }

  // Right, up and back of the picture.
  get axes() {
    const level = plus(this.out.map((x) => x * Math.cos(this.yaw)), this.side, Math.sin(this.yaw));
    const back = plus(level.map((x) => x * Math.cos(this.pitch)), this.up, Math.sin(this.pitch));
    const right = cross(this.up, level);
    return [right, cross(back, right), back];
  }

  turn(yaw, pitch) {
    this.yaw += yaw;
    this.pitch = Math.max(-NEARLY_UP, Math.min(NEARLY_UP, this.pitch + pitch));
  }

  // Move what is seen by parts of the picture's height.
  pan(right, up) {
    const [x, y] = this.axes;
    const each = 2 * this.slope * this.distance;
    this.target = plus(plus(this.target, x, -right * each), y, -up * each);
  }

  // Come nearer by a factor, towards a point of the picture (-1 to 1, from the middle).
  zoom(factor, at = [0, 0], aspect = 1) {
    const from = this.distance;
    const bounded = Math.min(this.size * MOST_ZOOM, Math.max(this.size / MOST_ZOOM, from / factor));
    const [x, y] = this.axes;
    const gained = (from - bounded) * this.slope;
    this.target = plus(plus(this.target, x, at[0] * aspect * gained), y, at[1] * gained);
    this.distance = bounded;
  }

  // See all of a box from where the camera looks; parts of the picture's height and width
  // are taken by what is below and on the right.
  fit(box, aspect, below = 0, right = 0) {
    const [lower, upper] = box;
    this.target = lower.map((x, k) => 0.5 * (x + upper[k]));
    this.size = length(minus(upper, lower)) || 1;
    const axes = this.axes;
    let needed = 0;
    for (let k = 0; k < 8; k++) {
      const corner = minus([0, 1, 2].map((i) => ((k >> i) & 1 ? upper : lower)[i]), this.target);
      const [x, y, z] = axes.map((axis) => dot(axis, corner));
      needed = Math.max(needed, Math.max(Math.abs(x) / (aspect * (1 - right)), Math.abs(y) / (1 - below)) / this.slope + z);
    }
    this.distance = ROOM * needed || this.size;
    this.pan(-0.5 * right * aspect, 0.5 * below);
  }
}

// Mouse, wheel and touch on an element. moved() is called after every change, fit() on a double click.
export function attach(camera, element, moved, fit) {
  const pointers = new Map();
  const place = (event) => {
    const box = element.getBoundingClientRect();
    return [(event.clientX - box.left) / box.height, (event.clientY - box.top) / box.height];
  };
  const spread = () => {
    const [a, b] = [...pointers.values()];
    return { middle: [(a[0] + b[0]) / 2, (a[1] + b[1]) / 2], apart: Math.hypot(a[0] - b[0], a[1] - b[1]) };
  };
  element.addEventListener("pointerdown", (event) => {
    element.setPointerCapture(event.pointerId);
    pointers.set(event.pointerId, place(event));
  });
  for (const end of ["pointerup", "pointercancel"]) {
    element.addEventListener(end, (event) => pointers.delete(event.pointerId));
  }
  element.addEventListener("pointermove", (event) => {
    const before = pointers.get(event.pointerId);
    if (!before || pointers.size > 2) return;
    const now = place(event);
    if (pointers.size === 2) {
      const was = spread();
      pointers.set(event.pointerId, now);
      const is = spread();
      camera().pan(is.middle[0] - was.middle[0], was.middle[1] - is.middle[1]);
      if (was.apart > 0 && is.apart > 0) camera().zoom(is.apart / was.apart);
    } else {
      pointers.set(event.pointerId, now);
      const [right, down] = [now[0] - before[0], now[1] - before[1]];
      const moves = event.buttons & 6 || event.shiftKey || event.ctrlKey;
      if (moves) camera().pan(right, -down);
      else camera().turn(-right * Math.PI, down * Math.PI);
    }
    moved();
  });
  element.addEventListener("wheel", (event) => {
    event.preventDefault();
    const lines = event.deltaMode === 1 ? 30 : 1;
    const box = element.getBoundingClientRect();
    const [x, y] = place(event);
    const aspect = box.width / box.height;
    camera().zoom(Math.exp(-event.deltaY * lines * 0.0012), [(2 * x) / aspect - 1, 1 - 2 * y], aspect);
    moved();
  }, { passive: false });
  element.addEventListener("contextmenu", (event) => event.preventDefault());
  element.addEventListener("dblclick", fit);
}
