const kHeightAngle = 0.85;  // of the free eye's picture, radians
const kTurnPerPixel = 0.006, kTurnPerKey = 0.08, kMovePerKey = 0.05, kZoomPerKey = 1.15;

// An eye that goes round a point, and the mouse, touch and keys that move it.
class Orbit {
  constructor(canvas, up, onChange) {
    this.canvas = canvas;
    this.onChange = onChange;
    this.pointers = new Map();
    this.setUp(up);
    this.listen();
  }

  setUp(up) {
    this.up = up;
    // The axis that is least like up stays level.
    const sizes = up.map(Math.abs), least = sizes.indexOf(Math.min(...sizes));
    const axis = [0, 0, 0];
    axis[least] = 1;
    this.east = normalized(subtract(axis, scaled(up, dot(axis, up))));
    this.north = cross(up, this.east);
  }

  // From behind cameras that look along `forward`, and from above.
  show(extent, forward) {
    this.isUntouched = true;
    this.target = extent.middle;
    this.radius = this.shownRadius = extent.radius;
    this.distance = 1.8 * extent.radius / Math.min(1, this.canvas.clientWidth / this.canvas.clientHeight || 1);
    this.turn = Math.atan2(-dot(forward, this.east), dot(forward, this.north)) + 0.5;
    this.rise = 0.5;
    this.onChange();
  }
  lookFromAbove() {
    this.isUntouched = false;
    [this.turn, this.rise] = [0, 1.5];
    this.onChange();
  }

  // From the target to the eye.
  get outward() {
    const level = add(scaled(this.east, Math.sin(this.turn)), scaled(this.north, -Math.cos(this.turn)));
    return add(scaled(level, Math.cos(this.rise)), scaled(this.up, Math.sin(this.rise)));
  }
  get eye() { return add(this.target, scaled(this.outward, this.distance)); }
  get forward() { return scaled(this.outward, -1); }

  rotate(turn, rise) {
    this.isUntouched = false;
    this.turn -= turn;
    this.rise = clamp(this.rise + rise, -1.5, 1.5);
    this.onChange();
  }
  // In parts of the picture's height.
  move(right, upward) {
    this.isUntouched = false;
    const size = 2 * this.distance * Math.tan(kHeightAngle / 2);
    const side = normalized(cross(this.forward, this.up));
    this.target = add(this.target, add(scaled(side, -right * size), scaled(cross(side, this.forward), upward * size)));
    this.onChange();
  }
  zoom(factor) {
    this.isUntouched = false;
    this.distance = clamp(this.distance * factor, 0.01 * this.radius, 20 * this.radius);
    this.onChange();
  }

  listen() {
    const canvas = this.canvas;
    canvas.addEventListener("pointerdown", (e) => {
      canvas.setPointerCapture(e.pointerId);
      this.pointers.set(e.pointerId, [e.clientX, e.clientY]);
    });
    const release = (e) => this.pointers.delete(e.pointerId);
    canvas.addEventListener("pointerup", release);
    canvas.addEventListener("pointercancel", release);
    canvas.addEventListener("pointermove", (e) => this.dragged(e, canvas.clientHeight));
    canvas.addEventListener("contextmenu", (e) => e.preventDefault());
    canvas.addEventListener("wheel", (e) => {
      e.preventDefault();
      this.zoom(Math.exp(clamp(e.deltaY * (e.deltaMode ? 16 : 1), -200, 200) * 0.0015));
    }, {passive: false});
    canvas.addEventListener("keydown", (e) => {
      if (this.key(e)) e.preventDefault();
    });
  }

  dragged(e, height) {
    const before = this.pointers.get(e.pointerId);
    if (!before) return;
    const now = [e.clientX, e.clientY], dx = now[0] - before[0], dy = now[1] - before[1];
    this.pointers.set(e.pointerId, now);
    const other = [...this.pointers].find(([id]) => id !== e.pointerId);
    if (other) {
      const gap = (p) => Math.hypot(p[0] - other[1][0], p[1] - other[1][1]);
      this.move(dx / height / 2, dy / height / 2);
      if (gap(now) > 10) this.zoom(gap(before) / gap(now));
    } else if (e.buttons & 6 || e.shiftKey) {
      this.move(dx / height, dy / height);
    } else {
      this.rotate(dx * kTurnPerPixel, dy * kTurnPerPixel);
    }
  }

  key(e) {
    const step = {ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1]}[e.key];
    if (e.ctrlKey || e.metaKey || e.altKey) return false;
    if (step && e.shiftKey) this.move(-step[0] * kMovePerKey, -step[1] * kMovePerKey);
    else if (step) this.rotate(step[0] * kTurnPerKey, step[1] * kTurnPerKey);
    else if (e.key === "+" || e.key === "=") this.zoom(1 / kZoomPerKey);
    else if (e.key === "-") this.zoom(kZoomPerKey);
    else return false;
    return true;
  }
}
