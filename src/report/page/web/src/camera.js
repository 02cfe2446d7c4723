// Where a body in space is looked at from: turned, moved and magnified by mouse, touch and keys.

/** Turn by a pixel, and by a key (radians). */
const BY_PIXEL = 0.008;
const BY_KEY = Math.PI / 18;
const NEARER = 1.2;
/** A pointer that moved by more has not clicked. */
const STILL = 4;

/** The corner and the axes that a body is looked at from, by name: longitude and latitude. */
const SIDES = { "+x": [0, 0], "−x": [Math.PI, 0], "+y": [Math.PI / 2, 0], "−y": [-Math.PI / 2, 0], "+z": [-Math.PI / 2, Math.PI / 2], "−z": [-Math.PI / 2, -Math.PI / 2] };

export class Camera {
  /** `eye`: a unit vector towards the eye; `changed`: what to do when it moved. */
  constructor(eye, changed) {
    this.home = [Math.atan2(eye[1], eye[0]), Math.asin(Math.max(-1, Math.min(1, eye[2])))];
    this.changed = changed;
    this.pointers = new Map();
    this.reset();
  }

  static get sides() {
    return Object.keys(SIDES);
  }

  reset() {
    this.from(...this.home);
    this.zoom = 1;
    this.shift = [0, 0];
  }

  /** From the corner that it began at, or along an axis. */
  look(side) {
    this.reset();
    if (SIDES[side]) this.from(...SIDES[side]);
  }

  /** `stands`: nobody has turned it since. */
  from(longitude, latitude) {
    this.longitude = longitude;
    this.latitude = Math.max(-Math.PI / 2, Math.min(Math.PI / 2, latitude));
    this.stands = true;
  }

  turn(longitude, latitude) {
    this.from(this.longitude + longitude, this.latitude + latitude);
    this.stands = false;
    this.changed();
  }

  magnify(factor) {
    this.zoom = Math.max(0.2, Math.min(200, this.zoom * factor));
    this.changed();
  }

  /** Unit vectors to the right, up, and towards the eye. */
  axes() {
    const [s, c] = [Math.sin(this.longitude), Math.cos(this.longitude)];
    const [t, d] = [Math.sin(this.latitude), Math.cos(this.latitude)];
    return [[-s, c, 0], [-t * c, -t * s, d], [d * c, d * s, t]];
  }

  /** Listen to an element; `back` turns it as it was at first. */
  on(target, back) {
    this.back = back;
    target.addEventListener("pointerdown", (event) => {
      if (!this.pointers.size) this.path = 0;
      this.pointers.set(event.pointerId, [event.clientX, event.clientY]);
      target.setPointerCapture(event.pointerId);
    });
    const up = (event) => this.pointers.delete(event.pointerId);
    target.addEventListener("pointerup", up);
    target.addEventListener("pointercancel", up);
    target.addEventListener("lostpointercapture", up);
    target.addEventListener("pointermove", (event) => this.drag(event));
    target.addEventListener("contextmenu", (event) => event.preventDefault());
    // a page scrolls on over a body that nobody has taken hold of
    target.addEventListener(
      "wheel",
      (event) => {
        if (!event.ctrlKey && document.activeElement !== target) return;
        event.preventDefault();
        this.magnify(NEARER ** (-event.deltaY / 100));
      },
      { passive: false },
    );
    target.addEventListener("keydown", (event) => this.key(event));
  }

  drag(event) {
    const before = this.pointers.get(event.pointerId);
    if (!before) return;
    const now = [event.clientX, event.clientY];
    const [dx, dy] = [now[0] - before[0], now[1] - before[1]];
    this.path += Math.hypot(dx, dy);
    const other = [...this.pointers].find(([id]) => id !== event.pointerId)?.[1];
    this.pointers.set(event.pointerId, now);
    if (other) {
      // two fingers: nearer, and along
      const distance = ([x, y]) => Math.hypot(x - other[0], y - other[1]);
      this.shift = [this.shift[0] + dx / 2, this.shift[1] + dy / 2];
      this.magnify(distance(now) / (distance(before) || 1));
    } else if (event.shiftKey || event.buttons & 6) {
      this.shift = [this.shift[0] + dx, this.shift[1] + dy];
      this.changed();
    } else this.turn(-BY_PIXEL * dx, BY_PIXEL * dy);
  }

  key(event) {
    if (event.ctrlKey || event.metaKey || event.altKey) return;
    const acts = {
      ArrowLeft: () => this.turn(BY_KEY, 0),
      ArrowRight: () => this.turn(-BY_KEY, 0),
      ArrowUp: () => this.turn(0, BY_KEY),
      ArrowDown: () => this.turn(0, -BY_KEY),
      "+": () => this.magnify(NEARER),
      "-": () => this.magnify(1 / NEARER),
      0: () => this.back(),
    };
    if (!acts[event.key]) return;
    // these keys are time's elsewhere
    event.preventDefault();
    event.stopPropagation();
    acts[event.key]();
  }

  /** Whether the pointer that went up last had moved. */
  moved() {
    return this.path > STILL;
  }
}
