const byId = (id) => document.getElementById(id);
const styleColour = (name) => getComputedStyle(document.documentElement).getPropertyValue(name).trim();

const kOutgrown = 1.2;  // a live way that reaches so much farther is shown as a whole again, unless the reader moved the view

const isSamePlace = (a, b) => b !== undefined && Math.hypot(a[0] - b[0], a[1] - b[1], a[2] - b[2]) < 1e-6;

// The page: what is shown, what the controls do.
class App {
  constructor(renderer, json) {
    this.renderer = renderer;
    this.isPlaying = false;
    this.layers = {points: true, way: true, truth: true, keyFrames: true};
    this.isFrameWanted = false;
    this.load(json);
    this.orbit = new Orbit(renderer.canvas, json.up, () => this.redraw());
    this.showWhole();
    this.strip = new Strip(byId("strip"), (share) => this.seek(share * this.duration));
    this.connectControls();
    this.updateLines();
  }

  load(json) {
    this.live = json.live || null;
    this.runs = json.runs.map((run, i) => new Run(run, i));
    this.extent = extentOf(this.runs);
    const hasErrors = this.runs.some((run) => run.hasErrors);
    const colouring = byId("colouring");
    colouring.querySelector("[value=error]").disabled = !hasErrors;
    if (!this.colouring || (this.colouring === "error" && !hasErrors))
      colouring.value = this.runs.length > 1 ? "run" : hasErrors ? "error" : "speed";
    this.colouring = colouring.value;
    this.chart = hasErrors ? "error" : "speed";
    this.followsNewest = this.live !== null;
    byId("newest").hidden = !this.live;
    this.time = this.followsNewest ? this.duration : 0;
    this.renderer.setClouds(this.runs.map((run) => run.cloud));
    this.makeLayerBoxes();
    const frames = json.inTruthWorld ? "in the world of the ground truth" : this.runs.length > 1 ? "each in its own world, not aligned" : "";
    byId("state").textContent = [this.live ? "live" : "", frames].filter(Boolean).join(", ");
  }

  get duration() { return Math.max(0, ...this.runs.map((run) => run.track.end)); }

  makeLayerBoxes() {
    const box = byId("layers");
    box.replaceChildren();
    const addBox = (text, isOn, change) => {
      const label = document.createElement("label"), input = document.createElement("input");
      input.type = "checkbox";
      input.checked = isOn;
      input.addEventListener("change", () => {
        change(input.checked);
        this.updateLines();
      });
      label.append(input, text);
      box.append(label);
    };
    const names = {points: "points", way: "way", truth: "ground truth", keyFrames: "key frames"};
    for (const [key, text] of Object.entries(names)) {
      if (key === "truth" && !this.runs.some((run) => run.truth.size)) continue;
      addBox(text, this.layers[key], (isOn) => (this.layers[key] = isOn));
    }
    if (this.runs.length < 2) return;
    for (const run of this.runs) addBox(run.name, run.shown, (isOn) => (run.shown = isOn));
  }

  connectControls() {
    byId("play").addEventListener("click", () => this.play(!this.isPlaying));
    byId("time").addEventListener("input", (e) => this.seek(Number(e.target.value)));
    byId("colouring").addEventListener("change", (e) => {
      this.colouring = e.target.value;
      this.updateLines();
    });
    byId("eye").addEventListener("change", () => this.redraw());
    byId("size").addEventListener("input", () => this.redraw());
    byId("whole").addEventListener("click", () => this.showWhole());
    byId("above").addEventListener("click", () => this.lookFromAbove());
    byId("newest").addEventListener("click", () => this.setFollowsNewest(!this.followsNewest));
    this.renderer.canvas.addEventListener("keydown", (e) => this.key(e));
    new ResizeObserver(() => this.redraw()).observe(byId("view"));
    matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => this.updateLines());
  }

  key(e) {
    const track = this.runs[0].track, i = track.indexAt(this.time);
    const actions = {
      " ": () => this.play(!this.isPlaying), Home: () => this.showWhole(), a: () => this.lookFromAbove(), A: () => this.lookFromAbove(),
      ",": () => this.seek(track.times[Math.max(0, i - 1)]), ".": () => this.seek(track.times[Math.min(track.size - 1, i + 1)]),
    };
    if (!actions[e.key] || e.ctrlKey || e.metaKey || e.altKey) return;
    e.preventDefault();
    actions[e.key]();
  }

  showWhole() {
    byId("eye").value = "free";
    this.orbit.show(this.extent, meanForward(this.runs));
  }
  lookFromAbove() {
    byId("eye").value = "free";
    this.orbit.lookFromAbove();
  }

  setFollowsNewest(follows) {
    this.followsNewest = follows;
    byId("newest").setAttribute("aria-pressed", follows);
    if (follows) this.time = this.duration;
    this.redraw();
  }

  seek(time) {
    if (!Number.isFinite(time)) return;
    this.time = clamp(time, 0, this.duration);
    this.setFollowsNewest(false);
  }

  play(isPlaying) {
    if (isPlaying && this.time >= this.duration) this.time = 0;
    this.isPlaying = isPlaying;
    this.lastTick = undefined;
    byId("play").textContent = isPlaying ? "Pause" : "Play";
    byId("play").setAttribute("aria-pressed", isPlaying);
    this.setFollowsNewest(false);
  }

  redraw() {
    if (this.isFrameWanted) return;
    this.isFrameWanted = true;
    requestAnimationFrame((now) => {
      this.isFrameWanted = false;
      if (this.isPlaying) this.advance(now);
      this.draw();
      if (this.isPlaying) this.redraw();
    });
  }

  advance(now) {
    if (this.lastTick !== undefined) this.time += (now - this.lastTick) / 1e3 * Number(byId("rate").value);
    this.lastTick = now;
    if (this.time < this.duration) return;
    this.time = this.duration;
    this.play(false);
  }

  // Lines that change when the data, the colours or the theme do.
  updateLines() {
    const shown = this.runs.filter((run) => run.shown);
    const most = this.colouring === "run" ? 0 : rangeOf(shown, this.colouring);
    this.frustumDepth = clamp(0.05 * this.extent.wayRadius, 0.015, 0.15);
    const truthColour = colourOf(styleColour("--truth")), keyFrameColour = colourOf(styleColour("--key-frame"));
    this.runs.forEach((run, i) => {
      const several = this.runs.length > 1;
      this.renderer.setLines(`keyFrames${i}`, frusta(run.keyFrames, this.frustumDepth, several ? colourOf(run.colour) : keyFrameColour), 1, 0.5);
      this.renderer.setLines(`truth${i}`, wayLine(run.truth, () => truthColour), 1.6);
      this.renderer.setLines(`way${i}`, colouredWay(run, this.colouring, most), 3);
    });
    this.drawLegend(shown, most);
    this.redraw();
  }

  drawLegend(shown, most) {
    const legend = byId("legend");
    legend.replaceChildren();
    const entry = (...parts) => {
      const span = document.createElement("span");
      span.append(...parts);
      legend.append(span);
    };
    const mark = (style, name) => {
      const i = document.createElement("i");
      if (name) i.className = name;
      i.style.background = style;
      return i;
    };
    if (this.colouring !== "run") {
      const kind = kKinds[this.colouring];
      entry(`${kind.title} 0`, mark(`linear-gradient(to right, ${kRamp.join(", ")})`, "ramp"), kind.format(most));
    } else {
      for (const run of shown) entry(mark(run.colour), run.name);
    }
    if (this.layers.truth && shown.some((run) => run.truth.size)) entry(mark(styleColour("--truth")), "ground truth");
  }

  isShown(name) {
    if (typeof name === "number") return this.layers.points && this.runs[name].shown;
    if (name === "camera") return byId("eye").value !== "camera";
    const [, layer, index] = name.match(/^(\D+)(\d+)$/);
    if (layer === "keyFrames" && byId("eye").value === "camera") return false;  // they are where the eye is
    return this.layers[layer] && this.runs[index].shown;
  }

  // Where the free, following or recorded eye is.
  currentEye(pose) {
    const kind = byId("eye").value;
    if (kind === "camera" && pose)
      return {eye: pose.position, forward: rotated(pose.rotation, [0, 0, 1]), up: rotated(pose.rotation, [0, -1, 0])};
    if (kind === "follow" && pose) this.orbit.target = pose.position;
    return {eye: this.orbit.eye, forward: this.orbit.forward, up: this.orbit.up};
  }

  draw() {
    const aspect = this.renderer.fit(), points = [];
    const poses = this.runs.map((run) => (run.shown ? run.track.poseAt(this.time) : null));
    poses.forEach((pose, i) => {
      const colour = colourOf(this.runs.length > 1 ? this.runs[i].colour : styleColour("--camera"));
      if (pose) addFrustum(points, pose.position, pose.rotation, 2.5 * this.frustumDepth, colour);
    });
    this.renderer.setLines("camera", points, 2.5);
    const {eye, forward, up} = this.currentEye(poses.find(Boolean));
    const far = length(subtract(eye, this.extent.middle)) + 20 * this.extent.radius;
    const view = perspective(kHeightAngle, aspect, Math.max(0.01, far * 2e-4), far);
    const middle = dot(this.orbit.up, this.extent.middle), half = 0.5 * this.extent.radius;
    this.renderer.draw({
      clipFromWorld: multiplied(view, eyeFromWorld(eye, forward, up)), focal: 0.5 / Math.tan(kHeightAngle / 2), up: this.orbit.up,
      heights: [middle - half, middle + half], low: colourOf(styleColour("--cloud-low")), high: colourOf(styleColour("--cloud-high")),
      pointScale: 2 ** Number(byId("size").value), isShown: (name) => this.isShown(name),
    });
    this.drawTime();
  }

  drawTime() {
    const slider = byId("time"), kind = kKinds[this.chart], shown = this.runs.filter((run) => run.shown && run.track.size);
    slider.max = this.duration;
    slider.value = this.time;
    const parts = [`${this.time.toFixed(2)} s of ${this.duration.toFixed(2)} s`];
    for (const run of shown) {
      const i = run.track.indexAt(this.time), name = this.runs.length > 1 ? run.name + " " : "";
      if (Number.isFinite(run.errors[i])) parts.push(`${name}error ${kKinds.error.format(run.errors[i])}`);
      else if (Number.isFinite(run.speeds[i])) parts.push(`${name}${kKinds.speed.format(run.speeds[i])}`);
    }
    byId("readout").textContent = parts.join(" \u00b7 ");
    slider.setAttribute("aria-valuetext", parts.join(", "));
    this.strip.draw({
      title: `${kind.title} over time`, duration: this.duration, time: this.time, format: kind.format,
      textColour: styleColour("--text"), lineColour: styleColour("--line"),
      curves: shown.map((run) => ({
        colour: this.runs.length > 1 ? run.colour : styleColour("--accent"), times: run.track.times, values: run.values(this.chart),
        hasGapAfter: (i) => run.track.hasGapAfter(i),
      })),
    });
  }

  // The folder's files are others than before. In the same world, as while a run goes on, the reader's view stays.
  reload(json) {
    const {time, followsNewest} = this, begin = this.runs[0].track.positions[0];
    this.load(json);
    if (begin && isSamePlace(begin, this.runs[0].track.positions[0])) {
      this.followsNewest = followsNewest && this.live !== null;
      this.time = this.followsNewest ? this.duration : Math.min(time, this.duration);
      this.orbit.radius = this.extent.radius;
    } else {
      this.orbit.setUp(json.up);
      this.showWhole();
    }
    byId("newest").setAttribute("aria-pressed", this.followsNewest);
    this.updateLines();
  }

  append(poses) {
    const wasEmpty = this.runs[0].track.size === 0;
    this.runs[0].append(poses);
    this.extent = extentOf(this.runs);
    this.orbit.radius = this.extent.radius;
    const hasOutgrown = this.orbit.isUntouched && this.extent.radius > kOutgrown * this.orbit.shownRadius;
    if (wasEmpty || hasOutgrown) this.orbit.show(this.extent, meanForward(this.runs));
    if (this.followsNewest) this.time = this.duration;
    this.updateLines();
  }
}

// A page that the program serves hears of what changes in the folder.
class LiveLink {
  constructor(app) {
    this.app = app;
    this.isReading = this.isStale = false;
    this.listen();
  }

  listen() {
    const {generation, poses} = this.app.live;
    const source = new EventSource(`events?at=${generation}:${poses}`);
    source.addEventListener("poses", (e) => this.app.append(JSON.parse(e.data)));
    source.addEventListener("numbers", () => this.readPanel());
    source.addEventListener("scene", () => {
      source.close();
      this.readScene();
    });
    source.onopen = () => this.say("live");
    source.onerror = () => this.say("not connected: the program that serves this page has ended, or cannot be reached");
  }

  say(text) { byId("state").textContent = text; }

  async readPanel() {
    const answer = await fetch("panel.html");
    if (answer.ok) byId("panel").innerHTML = await answer.text();  // foreign text in it is escaped
  }

  async readScene() {
    const answer = await fetch("scene.json");
    if (!answer.ok) return this.say(await answer.text());
    this.app.reload(await answer.json());
    await this.readPanel();
    this.listen();
  }
}

function start() {
  const json = JSON.parse(byId("scene").textContent);
  let renderer;
  try {
    renderer = new Renderer(byId("canvas"));
  } catch (error) {
    byId("why").textContent += ` (${error.message})`;
    return;
  }
  document.documentElement.classList.add("gl");
  const app = new App(renderer, json);
  if (json.live) new LiveLink(app);
}
start();
