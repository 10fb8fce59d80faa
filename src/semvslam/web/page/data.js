// The scene as the program wrote it, and questions about it.

const kLongestStep_s = 0.5;  // a longer silence is drawn as a gap, unless ten usual steps take as long
const kRunColours = ["#0868ac", "#e6740b", "#1f9e89", "#d0428f", "#8d5fd3", "#4c9a2a", "#b59a00"];
const kRamp = ["#3b6fd4", "#20a5a0", "#7db342", "#e0a21b", "#d6452f"];

function bytesOf(base64) {
  const text = atob(base64);
  const bytes = new Uint8Array(text.length);
  for (let i = 0; i < text.length; ++i) bytes[i] = text.charCodeAt(i);
  return bytes;
}
const floatsOf = (base64) => Array.from(new Float32Array(bytesOf(base64).buffer));

function colourOf(hex) {
  return [1, 3, 5].map((i) => parseInt(hex.slice(i, i + 2), 16) / 255);
}
const kRampColours = kRamp.map(colourOf);

function rampColour(share) {
  const at = clamp(share, 0, 1) * (kRampColours.length - 1);
  const i = Math.min(Math.floor(at), kRampColours.length - 2);
  return kRampColours[i].map((c, k) => c + (at - i) * (kRampColours[i + 1][k] - c));
}

function medianOf(values) {
  const sorted = values.filter(Number.isFinite).sort((a, b) => a - b);
  return sorted.length ? sorted[sorted.length >> 1] : 0;
}

// Poses over time; more may be appended.
class Track {
  constructor(json) {
    this.times = floatsOf(json.times);
    const numbers = floatsOf(json.poses);
    this.positions = [];
    this.rotations = [];
    for (let i = 0; i < numbers.length; i += 7) {
      this.positions.push(numbers.slice(i, i + 3));
      this.rotations.push(numbers.slice(i + 3, i + 7));
    }
    this.findLongestStep();
  }
  get size() { return this.times.length; }
  get end() { return this.size ? this.times[this.size - 1] : 0; }

  findLongestStep() {
    const steps = [];
    for (let i = 1; i < this.size; ++i) steps.push(this.times[i] - this.times[i - 1]);
    this.longestStep = Math.max(kLongestStep_s, 10 * medianOf(steps));
  }

  append(numbers) {
    if (this.size && numbers[0] <= this.end) return false;
    this.times.push(numbers[0]);
    this.positions.push(numbers.slice(1, 4));
    this.rotations.push(numbers.slice(4, 8));
    return true;
  }

  hasGapAfter(i) { return this.times[i + 1] - this.times[i] > this.longestStep; }

  // Index of the last pose that is not later.
  indexAt(time) {
    let low = 0, high = this.size;
    while (low < high) {
      const middle = (low + high) >> 1;
      if (this.times[middle] <= time) low = middle + 1;
      else high = middle;
    }
    return Math.max(0, low - 1);
  }

  poseAt(time) {
    if (!this.size) return null;
    const i = this.indexAt(time);
    if (i + 1 >= this.size || this.hasGapAfter(i)) return {position: this.positions[i], rotation: this.rotations[i]};
    const share = clamp((time - this.times[i]) / (this.times[i + 1] - this.times[i]), 0, 1);
    return {
      position: add(this.positions[i], scaled(subtract(this.positions[i + 1], this.positions[i]), share)),
      rotation: mixedRotation(this.rotations[i], this.rotations[i + 1], share),
    };
  }

  // Over the poses a tenth of a second before and after: neighbours alone tell mostly noise.
  speedAt(i) {
    const from = this.indexAt(this.times[i] - 0.1), to = Math.min(this.size - 1, this.indexAt(this.times[i] + 0.1));
    const duration = this.times[to] - this.times[from];
    if (!(duration > 0) || duration > this.longestStep) return NaN;
    return length(subtract(this.positions[to], this.positions[from])) / duration;
  }
}

class Run {
  constructor(json, index) {
    this.name = json.name;
    this.colour = kRunColours[index % kRunColours.length];
    this.track = new Track(json.trajectory);
    this.truth = new Track(json.truth);
    this.keyFrames = new Track(json.keyFrames);
    this.errors = floatsOf(json.errors);
    this.speeds = this.track.times.map((_, i) => this.track.speedAt(i));
    this.cloud = {
      what: json.cloud.what, cell: json.cloud.cell, origin: json.cloud.origin, step: json.cloud.step,
      grid: new Uint16Array(bytesOf(json.cloud.grid).buffer), colours: bytesOf(json.cloud.colours),
    };
    this.shown = true;
  }
  get hasErrors() { return this.errors.some(Number.isFinite); }

  append(poses) {
    const before = this.track.size;
    for (const numbers of poses) this.track.append(numbers);
    this.track.findLongestStep();
    for (let i = Math.max(0, before - 10); i < this.track.size; ++i) this.speeds[i] = this.track.speedAt(i);
  }

  // What the colour of the way or the chart shows, per pose.
  values(kind) {
    return kind === "error" ? this.errors : kind === "speed" ? this.speeds : this.track.times;
  }
}

const halfDiagonal = (ends) => length(ends.map(([low, high]) => Math.max(0, high - low) / 2));

// Where everything is: around the ways and all but the outermost points.
function extentOf(runs) {
  const coordinates = [[], [], []];
  for (const run of runs) {
    const {grid, origin, step} = run.cloud;
    const stride = 3 * Math.max(1, Math.floor(grid.length / 3 / 2000));
    for (let i = 0; i < grid.length; i += stride)
      for (let axis = 0; axis < 3; ++axis) coordinates[axis].push(origin[axis] + step[axis] * grid[i + axis]);
  }
  const ends = coordinates.map((values) => {
    values.sort((a, b) => a - b);
    return values.length ? [values[Math.floor(0.03 * values.length)], values[Math.floor(0.97 * (values.length - 1))]] : [Infinity, -Infinity];
  });
  const way = [0, 1, 2].map(() => [Infinity, -Infinity]);
  for (const run of runs)
    for (const p of run.track.positions) p.forEach((x, axis) => (way[axis] = [Math.min(way[axis][0], x), Math.max(way[axis][1], x)]));
  way.forEach(([low, high], axis) => (ends[axis] = [Math.min(ends[axis][0], low), Math.max(ends[axis][1], high)]));
  if (!(ends[0][0] <= ends[0][1])) return {middle: [0, 0, 0], radius: 1, wayRadius: 1};
  return {middle: ends.map(([low, high]) => (low + high) / 2), radius: Math.max(0.2, halfDiagonal(ends)), wayRadius: halfDiagonal(way)};
}

function meanForward(runs) {
  let sum = [0, 0, 0];
  for (const run of runs)
    for (const rotation of run.track.rotations) sum = add(sum, rotated(rotation, [0, 0, 1]));
  return sum;
}
